import { ask, change, freeName, namesInUse, useStudio } from '../store'
import { GRID } from './insert'

/** Displacement of pasted blocks to the right and down, px. */
const PASTE_OFFSET = 30

/** Blocks and notes of the sheet as the text of a diagram file; undefined if there are none. */
async function copiedText(
  chosenNames: Iterable<string> = useStudio.getState().selection,
): Promise<string | undefined> {
  const { document } = useStudio.getState()
  const blocks = [...chosenNames].filter((name) => document?.blocks[name])
  const notes = [...chosenNames].filter((name) => document?.notes[name])
  if (!document || !(blocks.length || notes.length)) return undefined
  return ask({
    kind: 'copy',
    document: document.state.document,
    inside: document.inside,
    blocks,
    notes,
  })
}

/** Paste the blocks of a diagram text under unused names, and select them. */
async function pasteText(text: string, offset: number | [number, number] = PASTE_OFFSET): Promise<void> {
  const { document, select } = useStudio.getState()
  if (!document) return
  const { blocks = {}, layout = {} } = JSON.parse(text) as { blocks?: object; layout?: object }
  const names: Record<string, string> = {}
  const usedNames = new Set(namesInUse())
  for (const name of Object.keys(blocks)) usedNames.add((names[name] = freeName(name, usedNames)))
  let lastNote = Math.max(0, ...Object.keys(document.notes).map((id) => Number(id.slice(1)) || 0))
  for (const id of Object.keys(layout)) if (id.startsWith('/')) names[id] = `/${++lastNote}`
  if ((await change({ kind: 'paste', text, names, shift: offset })) !== undefined)
    select(Object.values(names))
}

export async function duplicate(): Promise<void> {
  const text = await copiedText()
  if (text) await pasteText(text)
}

/** Duplicate blocks and notes at a distance from them. */
export async function duplicateAt(names: readonly string[], shift: [number, number]): Promise<void> {
  const text = await copiedText(names)
  if (text) await pasteText(text, shift)
}

/** Copy the selection as the text of a diagram file, which can be pasted into another window or an e-mail. */
export async function copy(): Promise<void> {
  const text = await copiedText()
  if (text) await navigator.clipboard.writeText(text)
}

export async function cut(): Promise<void> {
  const { document, selection, select } = useStudio.getState()
  await copy()
  const blocks = [...selection].filter((name) => document?.blocks[name])
  const notes = [...selection].filter((name) => document?.notes[name])
  if (!blocks.length && !notes.length) return
  await change({ kind: 'remove', blocks, notes })
  select([])
}

export async function paste(): Promise<void> {
  const text = await navigator.clipboard.readText()
  if (isDiagram(text)) await pasteText(text)
}

/** Paste with the top left corner of all blocks and notes at a point of the sheet. */
export async function pasteAt({ x, y }: { x: number; y: number }): Promise<void> {
  const text = await navigator.clipboard.readText()
  if (!isDiagram(text)) return
  const { layout = {} } = JSON.parse(text) as { layout?: Record<string, { x?: number; y?: number }> }
  const positions = Object.values(layout).filter(
    (position) => position.x !== undefined && position.y !== undefined,
  )
  const onGrid = (point: number, coordinates: number[]) =>
    GRID * Math.round((point - Math.min(...coordinates)) / GRID)
  await pasteText(
    text,
    positions.length
      ? [
          onGrid(
            x,
            positions.map((position) => position.x!),
          ),
          onGrid(
            y,
            positions.map((position) => position.y!),
          ),
        ]
      : PASTE_OFFSET,
  )
}

/** Whether a text is a diagram; other clipboard contents are not pasted on the sheet. */
function isDiagram(text: string): boolean {
  try {
    const parsed: unknown = JSON.parse(text)
    return typeof parsed === 'object' && parsed !== null && 'format' in parsed && 'blocks' in parsed
  } catch {
    return false
  }
}
