import { showScope } from '../dock'
import type { Rectangle } from '../model/free_place'
import type { Place, SheetBlock, SheetNote, Wire } from '../protocol'
import { change, openSheet, useStudio } from '../store'
import { createNote } from './note_node'
import type { Places } from '../model/wires'

/** Commands of the visible sheet; `null` while there is none. */
export const sheetView: {
  fit: (() => void) | null
  /** The visible part of the sheet. */
  visible: (() => Rectangle) | null
  /** Zoom by a factor about the middle, or to 100 %. */
  zoom: ((factor: number | null) => void) | null
  /** Move the view so that a block is visible. */
  reveal: ((block: Rectangle) => void) | null
  /** Show a part of the sheet. */
  show: ((part: Rectangle) => void) | null
} = {
  fit: null,
  zoom: null,
  visible: null,
  reveal: null,
  show: null,
}

/** Zoom factor of one key press. */
export const ZOOM_STEP = 1.25

/** Distance of the selection from the edge of the visible part, px of the sheet. */
const AROUND_SELECTION = 30

/** Zoom to the selected blocks and notes, or to all without a selection. */
export function showSelection(): void {
  const { document, selection } = useStudio.getState()
  const boxes = [...selection].flatMap((name): Rectangle[] => {
    const block = document?.blocks[name]
    if (block) return [{ ...block.place, width: block.width, height: block.height }]
    const note = document?.notes[name]
    return note ? [{ ...note, width: 0, height: 0 }] : []
  })
  if (!boxes.length) return sheetView.fit?.()
  const left = Math.min(...boxes.map(({ x }) => x)) - AROUND_SELECTION
  const top = Math.min(...boxes.map(({ y }) => y)) - AROUND_SELECTION
  const right = Math.max(...boxes.map(({ x, width }) => x + width)) + AROUND_SELECTION
  const bottom = Math.max(...boxes.map(({ y, height }) => y + height)) + AROUND_SELECTION
  sheetView.show?.({ x: left, y: top, width: right - left, height: bottom - top })
}

/** Start a note in the centre of the visible part. */
export function addNote(): void {
  const view = sheetView.visible?.()
  if (view) createNote(view.x + view.width / 2, view.y + view.height / 2)
}

/** The kinds of views that are charts in the panel of the scopes. */
const CHARTS = new Set(['traces', 'path'])

/** Whether the run has a chart of a block. */
export const hasChart = (path: string): boolean =>
  useStudio.getState().run?.views.some((view) => view.block === path && CHARTS.has(view.kind)) ?? false

/**
 * Handle a double click: show the chart of a scope after a run, open a subsystem without a mask, otherwise
 * the parameters of the block.
 */
export function openBlock(block: SheetBlock): void {
  const { document, edit } = useStudio.getState()
  const path = [...(document?.inside ?? []), block.name].join('/')
  if (hasChart(path)) showScope(path)
  else if (block.opens && !block.mask.length && document) openSheet([...document.inside, block.name])
  else edit(block.name)
}

/** Send the present positions of blocks and notes as one step; some wires may be rerouted. */
export async function moveNodes(
  positions: Places,
  rewiring?: { wires: Wire[]; instead: Wire[] },
): Promise<void> {
  const { document } = useStudio.getState()
  const places: Record<string, Place> = {}
  const notes: Record<string, SheetNote> = {}
  for (const [id, position] of Object.entries(positions)) {
    const { x, y } = position
    const place = document?.blocks[id]?.place
    const note = document?.notes[id]
    if (place && (rewiring || place.x !== x || place.y !== y)) places[id] = { ...place, ...position }
    if (note && (note.x !== x || note.y !== y)) notes[id] = { ...note, x, y }
  }
  if (Object.keys(places).length || Object.keys(notes).length)
    await change({ kind: 'move', places, notes, ...rewiring })
}
