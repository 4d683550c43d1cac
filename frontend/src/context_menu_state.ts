import { create } from 'zustand'

/** An entry of a context menu. */
export interface Entry {
  title: string
  /** The key with the same effect. */
  keys?: string | undefined
  /** Whether the entry is available; by default always. */
  enabled?: boolean
  /** Whether an option is on. */
  checked?: boolean
  /** A colour to show beside the title, in CSS. */
  swatch?: string
  /** The entries of a submenu. */
  submenu?: Entries
  run?: () => void
}

/** The entries of a context menu; `null` is a dividing line. */
export type Entries = (Entry | null)[]

interface ContextMenu {
  opened: boolean
  /** The name of the menu for screen readers. */
  label: string
  /** Position, screen px. */
  at: { x: number; y: number }
  entries: Entries
  /** Distinguishes consecutive openings. */
  openCount: number
}

export const useContextMenu = create<ContextMenu>(() => ({
  opened: false,
  label: '',
  at: { x: 0, y: 0 },
  entries: [],
  openCount: 0,
}))

let focusedElement: Element | null = null

/** Open a context menu at a point of the window; the focus returns when it is closed. */
export function openMenu(label: string, at: { x: number; y: number }, entries: Entries): void {
  focusedElement = document.activeElement
  useContextMenu.setState((s) => ({ opened: true, label, at, entries, openCount: s.openCount + 1 }))
}

export function closeMenu(): void {
  const focusInMenu = document.activeElement?.closest('.context-menu')
  useContextMenu.setState({ opened: false })
  if (focusInMenu && focusedElement instanceof HTMLElement && focusedElement.isConnected)
    focusedElement.focus({ preventScroll: true })
}

/** Movement of a pressed right button, px, beyond which it is a drag and opens no menu. */
export const CLICK_PX = 3

/**
 * The handlers of an element with a context menu. Depending on the system, browsers send `contextmenu` when
 * the right button is pressed or when it is released. The menu opens at the release, unless the pointer has
 * moved by more than `CLICK_PX`. The Menu key opens the menu at the focused element.
 */
export function useMenuHandlers(open: (at: { x: number; y: number }, target: Element) => void) {
  return {
    onPointerDown: (event: React.PointerEvent) => {
      if (event.button !== 2 || hasOwnMenu(event.target)) return
      const { clientX: x, clientY: y } = event
      const target = event.target as Element
      const released = (pointerUp: PointerEvent) => {
        if (pointerUp.button !== 2) return
        removeEventListener('pointerup', released, true)
        if (Math.hypot(pointerUp.clientX - x, pointerUp.clientY - y) <= CLICK_PX) open({ x, y }, target)
      }
      addEventListener('pointerup', released, true)
    },
    onContextMenu: (event: React.MouseEvent) => {
      if (hasOwnMenu(event.target)) return
      event.preventDefault()
      if (event.button === 2) return
      const bounds = (event.target as Element).getBoundingClientRect()
      open({ x: bounds.x + bounds.width / 2, y: bounds.y + bounds.height / 2 }, event.target as Element)
    },
  }
}

/** Whether the browser's menu opens at an element: text fields need the clipboard commands of this menu. */
export const hasOwnMenu = (target: EventTarget): boolean =>
  target instanceof Element && target.closest('input, textarea, [role="menu"]') !== null
