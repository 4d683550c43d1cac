import type { Node, NodeProps } from '@xyflow/react'
import { memo, useEffect, useRef, useState } from 'react'
import { create } from 'zustand'
import type { SheetNote } from '../protocol'
import { holdKeys } from '../held_keys'
import { isCommandKey } from '../model/field_keys'
import { returnFocus } from '../sheet_focus'
import { change, selectIfUnchanged, useStudio } from '../store'

export type NoteNodeType = Node<{ note: SheetNote }, 'note'>

/** The note that is being edited, including new ones that are not on the sheet yet. */
const useNoteEditing = create<{ id: string | null }>(() => ({ id: null }))

/** Start a note at a position on the sheet. */
export function createNote(x: number, y: number): void {
  const { document, selection } = useStudio.getState()
  if (!document) return
  const numbers = Object.keys(document.notes).map((id) => Number(id.slice(1)) || 0)
  const id = `/${Math.max(0, ...numbers) + 1}`
  const created = async () => {
    const note = { x: Math.round(x), y: Math.round(y), text: 'Note' }
    if ((await change({ kind: 'notes', notes: { [id]: note } })) === undefined) return
    selectIfUnchanged(selection, [id])
    useNoteEditing.setState({ id })
    // The text typed meanwhile belongs to the note.
    await new Promise<void>((resolve) => {
      noteFocused = resolve
      setTimeout(resolve, FOCUS_TIMEOUT_MS)
    })
  }
  void holdKeys(created())
}

/** Called when the field of a note has the focus. */
let noteFocused = () => {}
/** Longest time to wait for the focus: the sheet may be closed meanwhile. */
const FOCUS_TIMEOUT_MS = 2000

export const editNote = (id: string): void => useNoteEditing.setState({ id })

/** An annotation on the sheet; a double click edits it in place. */
export const NoteNode = memo(function NoteNode({ id, data: { note }, selected }: NodeProps<NoteNodeType>) {
  const editing = useNoteEditing((s) => s.id === id)
  return (
    <div className={selected ? 'note selected' : 'note'} onDoubleClick={() => editNote(id)}>
      {editing ? <NoteEditor id={id} note={note} /> : note.text}
    </div>
  )
})

function NoteEditor({ id, note }: { id: string; note: SheetNote }) {
  const [text, setText] = useState(note.text)
  const commit = () => {
    useNoteEditing.setState({ id: null })
    const trimmed = text.trimEnd()
    if (!trimmed) void change({ kind: 'remove', notes: [id] })
    else if (trimmed !== note.text)
      void change({ kind: 'notes', notes: { [id]: { ...note, text: trimmed } } })
  }
  const field = useRef<HTMLTextAreaElement>(null)
  // A new note cannot have the focus before React Flow has measured and shown it.
  useEffect(() => {
    let handle = 0
    const focus = () => {
      field.current?.focus()
      if (window.document.activeElement === field.current) noteFocused()
      else handle = requestAnimationFrame(focus)
    }
    focus()
    return () => cancelAnimationFrame(handle)
  }, [])
  const lines = text.split('\n')
  return (
    <textarea
      className="nodrag nopan nowheel"
      aria-label="Note"
      ref={field}
      rows={lines.length}
      cols={Math.max(12, ...lines.map((line) => line.length + 1))}
      value={text}
      onFocus={(event) => event.target.select()}
      onChange={(event) => setText(event.target.value)}
      onBlur={commit}
      onKeyDown={(event) => {
        // Ctrl+Enter accepts the note; it does not run the model.
        if (!isCommandKey(event) || event.key === 'Enter') event.stopPropagation()
        const isAccepted = event.key === 'Enter' && (event.ctrlKey || event.metaKey)
        if (isAccepted) event.currentTarget.blur()
        if (event.key === 'Escape') useNoteEditing.setState({ id: null })
        if (isAccepted || event.key === 'Escape') returnFocus(id)
      }}
    />
  )
}
