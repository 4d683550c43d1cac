import { useEffect, type RefObject } from 'react'
import { commandOf } from '../commands'
import { showDialog } from '../dialogs'
import { change, openSheet, useStudio } from '../store'
import { selectedBlocks } from './arranging'
import { rename } from './block_node'
import { editNote } from './note_node'
import { addNote, moveNodes, openBlock, sheetView, ZOOM_STEP } from './sheet_actions'
import { wireKey, type Places } from '../model/wires'

const ARROW_STEP = 5

/** Keys that a focused button handles; all other keys are handled by the sheet. */
const BUTTON_KEYS = new Set(['Enter', ' ', 'Tab'])

/** Whether an element is a button whose group does not use the arrow keys. */
const isButton = (element: Element | null): boolean =>
  element instanceof HTMLButtonElement &&
  !element.closest('[role="tablist"], [role="radiogroup"], [role="listbox"], .timeline, .stage')

/** Delete the selected blocks, notes and wires. */
export function removeSelected(selectedWires: ReadonlySet<string>): void {
  const { document, selection, select } = useStudio.getState()
  const wires = (document?.wires ?? []).filter((wire) => selectedWires.has(wireKey(wire)))
  const blocks = [...selection].filter((name) => document?.blocks[name])
  const notes = [...selection].filter((name) => document?.notes[name])
  if (blocks.length || wires.length || notes.length) void change({ kind: 'remove', blocks, wires, notes })
  select([])
}

/** The keys of the sheet: active while the sheet or nothing has the focus. */
export function useSheetKeys(
  sheet: RefObject<HTMLDivElement | null>,
  selectedWires: ReadonlySet<string>,
  selectWires: (keys: ReadonlySet<string>) => void,
): void {
  const remove = () => {
    removeSelected(selectedWires)
    selectWires(new Set())
  }

  const handlePlainKey = (event: KeyboardEvent): boolean => {
    const { document, selection, select } = useStudio.getState()
    if (!document) return false
    const step = event.shiftKey ? 1 : ARROW_STEP
    const arrows: Record<string, [number, number]> = {
      ArrowLeft: [-step, 0],
      ArrowRight: [step, 0],
      ArrowUp: [0, -step],
      ArrowDown: [0, step],
    }
    const arrow = arrows[event.key]
    const [first] = selection
    if (event.key === 'Delete' || event.key === 'Backspace') remove()
    else if (event.key === 'F2' && first && document.notes[first]) editNote(first)
    else if (event.key === 'F2' && first) rename(first)
    else if (event.key === 'Enter' && first && document.notes[first]) editNote(first)
    else if (event.key === 'Enter' && selectedBlocks()[0]) openBlock(selectedBlocks()[0]!)
    else if (arrow && selection.size) {
      const positions: Places = {}
      for (const id of selection) {
        const position = document.blocks[id]?.place ?? document.notes[id]
        if (position) positions[id] = { x: position.x + arrow[0], y: position.y + arrow[1] }
      }
      void moveNodes(positions)
    } else if (event.key === '>') showDialog('connect')
    else if (event.key === '?') showDialog('keys')
    else if (event.key === '"') addNote()
    else if (event.key === ' ') sheetView.fit?.()
    else if (event.key === '+' || event.key === '=') sheetView.zoom?.(ZOOM_STEP)
    else if (event.key === '-') sheetView.zoom?.(1 / ZOOM_STEP)
    else if (event.key === '1') sheetView.zoom?.(null)
    else if (event.key === 'Escape' && document.inside.length && !selection.size)
      openSheet(document.inside.slice(0, -1))
    else if (event.key === 'Escape') select([])
    else if (/^\p{L}$/u.test(event.key)) showDialog('insert', event.key)
    else return false
    return true
  }

  const onKeyDown = (event: KeyboardEvent) => {
    // If the focused block was removed, nothing has the focus. A button outside the sheet handles only the
    // keys that press it.
    const focused = event.target instanceof Element ? event.target : null
    if (
      focused instanceof HTMLInputElement ||
      focused?.closest('textarea, [role="dialog"], [role="menu"], [role="slider"], [role="tree"]')
    )
      return
    if (event.defaultPrevented) return
    // After the selection by a rectangle, the panel around the sheet has the focus.
    const forSheet = sheet.current?.contains(focused) || focused?.contains(sheet.current)
    if (!forSheet && (BUTTON_KEYS.has(event.key) || (event.key.length > 1 && !isButton(focused)))) return
    const command = commandOf(event, true)
    if (command) {
      if (command.enabled?.() ?? true) command.run()
    } else if (event.ctrlKey || event.metaKey || event.altKey || !handlePlainKey(event)) return
    event.preventDefault()
    event.stopPropagation()
  }

  useEffect(() => {
    addEventListener('keydown', onKeyDown)
    return () => removeEventListener('keydown', onKeyDown)
  })
}
