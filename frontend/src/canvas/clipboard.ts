import { holdKeys } from '../held_keys'
import { freeShift, shiftIntoView } from '../model/free_place'
import { ask, change, freeName, namesInUse, refuse, selectIfUnchanged, useStudio } from '../store'
import { GRID } from './insert'
import { sheetView } from './sheet_actions'

/** Displacement of pasted blocks to the right and down, px. */
const PASTE_OFFSET = 30

/** Access to the clipboard; without the permission of the browser, a notice and undefined. */
async function withClipboard<T>(access: () => Promise<T>): Promise<T | undefined> {
  try {
    return await access()
  } catch {
    refuse({
      what: 'the browser does not give this page access to the clipboard',
      where: '',
      fix: 'allow it in the settings of the browser for this page',
    })
    return undefined
  }
}

const readClipboard = () => withClipboard(() => navigator.clipboard.readText())

/** Write a text to the clipboard; the result is whether this was possible. */
const writeClipboard = async (text: string): Promise<boolean> =>
  Boolean(await withClipboard(async () => (await navigator.clipboard.writeText(text), true)))

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
  const { document, selection } = useStudio.getState()
  if (!document) return
  const { blocks = {}, layout = {} } = JSON.parse(text) as {
    blocks?: object
    layout?: Record<string, { x?: number; y?: number }>
  }
  const names: Record<string, string> = {}
  const usedNames = new Set(namesInUse())
  for (const name of Object.keys(blocks)) usedNames.add((names[name] = freeName(name, usedNames)))
  let lastNote = Math.max(0, ...Object.keys(document.notes).map((id) => Number(id.slice(1)) || 0))
  for (const id of Object.keys(layout)) if (id.startsWith('/')) names[id] = `/${++lastNote}`
  // A copy at the place of another block or note would hide it.
  const places = [
    ...Object.values(document.blocks).map(({ place }) => place),
    ...Object.values(document.notes),
  ]
  const view = sheetView.visible?.()
  const areas = Object.values(document.blocks).map(({ place, width, height }) => ({
    ...place,
    width,
    height,
  }))
  const shift =
    typeof offset !== 'number'
      ? offset
      : // On another sheet, or after the view was moved, the places of the originals may be out of view.
        ((view && shiftIntoView(Object.values(layout), view, areas, GRID)) ??
        freeShift(Object.values(layout), places, offset))
  if ((await change({ kind: 'paste', text, names, shift })) !== undefined)
    selectIfUnchanged(selection, Object.values(names))
}

export const duplicate = (): Promise<void> => holdKeys(duplicateBy(PASTE_OFFSET))

/** Duplicate blocks and notes at a distance from them. */
export const duplicateAt = (names: readonly string[], shift: [number, number]): Promise<void> =>
  holdKeys(duplicateBy(shift, names))

async function duplicateBy(shift: number | [number, number], names?: readonly string[]): Promise<void> {
  const text = await copiedText(names)
  if (text) await pasteText(text, shift)
}

/** Copy the selection as the text of a diagram file, which can be pasted into another window or an e-mail. */
export const copy = async (): Promise<void> => void (await holdKeys(copySelection()))

/** Copy the selection; the result is whether it is in the clipboard. */
async function copySelection(): Promise<boolean> {
  const text = await copiedText()
  return text !== undefined && writeClipboard(text)
}

export const cut = (): Promise<void> => holdKeys(cutSelection())

async function cutSelection(): Promise<void> {
  const { document, selection } = useStudio.getState()
  // Blocks that are not in the clipboard would be lost.
  if (!(await copySelection())) return
  const blocks = [...selection].filter((name) => document?.blocks[name])
  const notes = [...selection].filter((name) => document?.notes[name])
  if (!blocks.length && !notes.length) return
  await change({ kind: 'remove', blocks, notes })
  selectIfUnchanged(selection, [])
}

export const paste = (): Promise<void> => holdKeys(pasteClipboard())

async function pasteClipboard(): Promise<void> {
  const text = await readClipboard()
  if (text !== undefined && isDiagram(text)) await pasteText(text)
}

/** Paste with the top left corner of all blocks and notes at a point of the sheet. */
export const pasteAt = (point: { x: number; y: number }): Promise<void> => holdKeys(pasteClipboardAt(point))

async function pasteClipboardAt({ x, y }: { x: number; y: number }): Promise<void> {
  const text = await readClipboard()
  if (text === undefined || !isDiagram(text)) return
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
