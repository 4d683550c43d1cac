import { connectionsTo, reconnections } from '../model/connections'
import { change, useStudio } from '../store'
import { selectedBlocks } from './arranging'

/** Connect the blocks that were selected to the clicked block, which is then selected alone. */
export function connectSelected(name: string, before: ReadonlySet<string>): void {
  const { document, select } = useStudio.getState()
  const block = document?.blocks[name]
  if (!document || !block || before.has(name)) return
  const selected = [...before].flatMap((other) => document.blocks[other] ?? [])
  const wires = connectionsTo(block, selected, document.wires)
  if (!wires.length) return
  void change({ kind: 'add', blocks: [], wires })
  select([name])
}

/** Delete the selected blocks and notes, and connect the neighbours of the blocks. */
export function removeAndReconnect(): void {
  const { document, selection, select } = useStudio.getState()
  const blocks = selectedBlocks()
  const notes = [...selection].filter((name) => document?.notes[name])
  void change({
    kind: 'remove',
    blocks: blocks.map(({ name }) => name),
    notes,
    reconnections: reconnections(blocks, document?.wires ?? []),
  })
  select([])
}
