import { ask, change, freeName, takenNames, useStudio } from '../store'
import { GRID } from './insert'

const SHIFT = 30

/** Blocks and notes of the sheet as the text of a diagram file; undefined if there are none. */
async function copied(
  chosen: Iterable<string> = useStudio.getState().selection,
): Promise<string | undefined> {
  const { document } = useStudio.getState()
  const blocks = [...chosen].filter((name) => document?.blocks[name])
  const notes = [...chosen].filter((name) => document?.notes[name])
  if (!document || !(blocks.length || notes.length)) return undefined
  return ask({
    kind: 'copy',
    document: document.state.document,
    inside: document.inside,
    blocks,
    notes,
  })
}

/** Paste the blocks of such a text under unused names, and select them. */
async function add(text: string, shift: number | [number, number] = SHIFT): Promise<void> {
  const { document, select } = useStudio.getState()
  if (!document) return
  const { blocks = {}, layout = {} } = JSON.parse(text) as { blocks?: object; layout?: object }
  const names: Record<string, string> = {}
  const taken = new Set(takenNames())
  for (const name of Object.keys(blocks)) taken.add((names[name] = freeName(name, taken)))
  let note = Math.max(0, ...Object.keys(document.notes).map((id) => Number(id.slice(1)) || 0))
  for (const id of Object.keys(layout)) if (id.startsWith('/')) names[id] = `/${++note}`
  if ((await change({ kind: 'paste', text, names, shift })) !== undefined) select(Object.values(names))
}

export async function duplicate(): Promise<void> {
  const text = await copied()
  if (text) await add(text)
}

/** Duplicate blocks and notes at a distance from them. */
export async function duplicateAt(chosen: readonly string[], shift: [number, number]): Promise<void> {
  const text = await copied(chosen)
  if (text) await add(text, shift)
}

/** Blocks are copied as the text of a diagram file, which can be pasted into another window or a mail. */
export async function copy(): Promise<void> {
  const text = await copied()
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
  if (isDiagram(text)) await add(text)
}

/** Paste with the top left corner of all blocks and notes at a point of the sheet. */
export async function pasteAt({ x, y }: { x: number; y: number }): Promise<void> {
  const text = await navigator.clipboard.readText()
  if (!isDiagram(text)) return
  const { layout = {} } = JSON.parse(text) as { layout?: Record<string, { x?: number; y?: number }> }
  const spots = Object.values(layout).filter((one) => one.x !== undefined && one.y !== undefined)
  const onGrid = (wanted: number, from: number[]) => GRID * Math.round((wanted - Math.min(...from)) / GRID)
  await add(
    text,
    spots.length
      ? [
          onGrid(
            x,
            spots.map((one) => one.x!),
          ),
          onGrid(
            y,
            spots.map((one) => one.y!),
          ),
        ]
      : SHIFT,
  )
}

/** Whether a text is a diagram; other clipboard contents are not pasted on the sheet. */
function isDiagram(text: string): boolean {
  try {
    const found: unknown = JSON.parse(text)
    return typeof found === 'object' && found !== null && 'format' in found && 'blocks' in found
  } catch {
    return false
  }
}
