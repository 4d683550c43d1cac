import { useEffect } from 'react'
import { commandOf } from '../commands'
import { showDialog } from '../dialogs'
import { change, openSheet, useStudio } from '../store'
import { selectedBlocks } from './arranging'
import { rename } from './block_node'
import { editNote } from './note_node'
import { addNote, moveNodes, openBlock, sheetView, showSelection, ZOOM_STEP } from './sheet_actions'
import { wireKey, type Places } from '../model/wires'
import { isForSheet } from '../sheet_focus'

const ARROW_STEP = 5

/** Delete the selected blocks, notes and wires. */
export function removeSelected(selectedWires: ReadonlySet<string>): void {
  const { document, selection, select } = useStudio.getState()
  const wires = (document?.wires ?? []).filter((wire) => selectedWires.has(wireKey(wire)))
  const blocks = [...selection].filter((name) => document?.blocks[name])
  const notes = [...selection].filter((name) => document?.notes[name])
  if (blocks.length || wires.length || notes.length) void change({ kind: 'remove', blocks, wires, notes })
  select([])
}

/** Fit the sheet when space is released, unless the pointer was pressed: space and a drag move the sheet. */
function fitAtRelease({ isTrusted, repeat }: KeyboardEvent): void {
  if (repeat) return
  // A replayed key (held_keys.ts) has no keyup event.
  if (!isTrusted) return sheetView.fit?.()
  const listeners = new AbortController()
  const { signal } = listeners
  addEventListener('pointerdown', () => listeners.abort(), { signal, capture: true })
  addEventListener(
    'keyup',
    ({ key }) => {
      if (key !== ' ') return
      listeners.abort()
      sheetView.fit?.()
    },
    { signal },
  )
}

/** The keys of the sheet: active while the sheet or nothing has the focus. */
export function useSheetKeys(
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
    else if (event.key === ' ') fitAtRelease(event)
    else if (event.key === '+' || event.key === '=') sheetView.zoom?.(ZOOM_STEP)
    else if (event.key === '-') sheetView.zoom?.(1 / ZOOM_STEP)
    else if (event.key === '1') sheetView.zoom?.(null)
    else if (event.key === '2') showSelection()
    else if (event.key === 'Escape' && document.inside.length && !selection.size)
      openSheet(document.inside.slice(0, -1))
    else if (event.key === 'Escape') select([])
    else if (/^\p{L}$/u.test(event.key)) showDialog('insert', event.key)
    else return false
    return true
  }

  const onKeyDown = (event: KeyboardEvent) => {
    // React Flow prevents the default action of space.
    if ((event.defaultPrevented && event.key !== ' ') || !isForSheet(event)) return
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
