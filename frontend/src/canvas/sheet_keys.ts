import { useEffect, type RefObject } from 'react'
import { commandOf } from '../commands'
import { show, useDialogs } from '../dialogs'
import { change, look, useStudio } from '../store'
import { chosenBlocks } from './arranging'
import { rename } from './block_node'
import { editNote } from './note_node'
import { addNote, move, openBlock, sheetView, ZOOM_STEP } from './sheet_actions'
import { wireKey, type Places } from '../model/wires'

const NUDGE = 5

/** Keys typed before the list of blocks has the focus. */
function typedSoFar(): string {
  const { open, typed } = useDialogs.getState()
  return open === 'insert' ? typed : ''
}

/** Keys that press a button or leave it; all others are keys of the sheet also after a button was pressed. */
const PRESSING = new Set(['Enter', ' ', 'Tab'])

/** Whether an element is a button whose group does not use the arrow keys. */
const isButton = (element: Element | null): boolean =>
  element instanceof HTMLButtonElement &&
  !element.closest('[role="tablist"], [role="radiogroup"], [role="listbox"], .timeline, .stage')

/** Delete the selected blocks, notes and wires. */
export function removeChosen(chosenWires: ReadonlySet<string>): void {
  const { document, selection, select } = useStudio.getState()
  const wires = (document?.wires ?? []).filter((wire) => chosenWires.has(wireKey(wire)))
  const blocks = [...selection].filter((name) => document?.blocks[name])
  const notes = [...selection].filter((name) => document?.notes[name])
  if (blocks.length || wires.length || notes.length) void change({ kind: 'remove', blocks, wires, notes })
  select([])
}

/** The keys of the sheet: active while the sheet or nothing has the focus. */
export function useSheetKeys(
  sheet: RefObject<HTMLDivElement | null>,
  chosenWires: ReadonlySet<string>,
  chooseWires: (keys: ReadonlySet<string>) => void,
): void {
  const remove = () => {
    removeChosen(chosenWires)
    chooseWires(new Set())
  }

  const plain = (event: KeyboardEvent): boolean => {
    const { document, selection, select } = useStudio.getState()
    if (!document) return false
    const step = event.shiftKey ? 1 : NUDGE
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
    else if (event.key === 'Enter' && chosenBlocks()[0]) openBlock(chosenBlocks()[0]!)
    else if (arrow && selection.size) {
      const to: Places = {}
      for (const id of selection) {
        const at = document.blocks[id]?.place ?? document.notes[id]
        if (at) to[id] = { x: at.x + arrow[0], y: at.y + arrow[1] }
      }
      void move(to)
    } else if (event.key === '>') show('connect')
    else if (event.key === '?') show('keys')
    else if (event.key === '"') addNote()
    else if (event.key === ' ') sheetView.fit?.()
    else if (event.key === '+' || event.key === '=') sheetView.zoom?.(ZOOM_STEP)
    else if (event.key === '-') sheetView.zoom?.(1 / ZOOM_STEP)
    else if (event.key === '1') sheetView.zoom?.(null)
    else if (event.key === 'Escape' && document.inside.length && !selection.size)
      look(document.inside.slice(0, -1))
    else if (event.key === 'Escape') select([])
    else if (/^\p{L}$/u.test(event.key)) show('insert', typedSoFar() + event.key)
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
    const ours = focused === window.document.body || sheet.current?.contains(focused)
    if (!ours && (PRESSING.has(event.key) || (event.key.length > 1 && !isButton(focused)))) return
    const command = commandOf(event, true)
    if (command) {
      if (command.possible?.() ?? true) command.run()
    } else if (event.ctrlKey || event.metaKey || event.altKey || !plain(event)) return
    event.preventDefault()
    event.stopPropagation()
  }

  useEffect(() => {
    addEventListener('keydown', onKeyDown)
    return () => removeEventListener('keydown', onKeyDown)
  })
}
