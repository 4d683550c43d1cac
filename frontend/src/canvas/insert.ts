import { freeBelow, freeInView, type Rectangle } from '../model/free_place'
import type { BlockType, Place, Wire } from '../protocol'
import { change, freeName, takenNames, useStudio } from '../store'
import { sheetView } from './sheet_actions'

/** Drag data from the library: a block type. */
export const BLOCK_TYPE = 'application/x-armblocks-block'

/** Grid of block positions, px. */
export const GRID = 5

interface Insertion {
  /** The wire into which the block is inserted. */
  wire?: Wire
  /** Height of the wire that enters the first input, which is then exactly straight. */
  level?: number
  /** A port to which the block is connected; the point is then at the edge of the block. */
  end?: { port: string; isOutput: boolean }
  /** Whether the view is moved so that the block is visible. */
  reveal?: boolean
  /** The values of its parameters that differ from the defaults. */
  parameters?: Record<string, unknown>
  /** The wish for its name. */
  name?: string
}

/** Add a new block of a type with its centre at a point, and select it; the result is its name. */
export async function insertBlock(
  type: string,
  at: { x: number; y: number },
  { wire, level, end, reveal = false, parameters = {}, name: wish }: Insertion = {},
): Promise<string | undefined> {
  const { document, library, select } = useStudio.getState()
  const kind = library.get(type)
  if (!document || !kind) return undefined
  const name = freeName((wish ?? kind.title).replace(/[/.]/g, ' '), takenNames())
  const entry = level === undefined ? undefined : sideEntry(kind)
  const part = !end ? 0.5 : end.isOutput ? 0 : 1
  const place: Place = {
    x: GRID * Math.round((at.x - part * kind.width) / GRID),
    y: entry === undefined ? GRID * Math.round((at.y - kind.height / 2) / GRID) : level! - entry,
  }
  const [input, output] = [kind.inputs[0], kind.outputs[0]]
  const between = wire && input && output
  const version = await change({
    kind: 'add',
    blocks: [{ name, type, place, parameters }],
    wires: end
      ? [
          end.isOutput
            ? { source: end.port, target: `${name}/${input}` }
            : { source: `${name}/${output}`, target: end.port },
        ]
      : between
        ? [
            { source: wire.source, target: `${name}/${input}` },
            { source: `${name}/${output}`, target: wire.target },
          ]
        : [],
    instead: between ? [wire] : [],
  })
  if (version === undefined) return undefined
  select([name])
  if (reveal) sheetView.reveal?.({ ...place, width: kind.width, height: kind.height })
  return name
}

/** The point of the sheet at a point of the window. */
export function placeAt(at: { x: number; y: number }): { x: number; y: number } {
  const pane = document.querySelector('.react-flow__viewport')
  const matrix = new DOMMatrix(pane ? getComputedStyle(pane).transform : undefined)
  const corner = document.querySelector('.react-flow')?.getBoundingClientRect()
  return {
    x: (at.x - (corner?.x ?? 0) - matrix.e) / matrix.a,
    y: (at.y - (corner?.y ?? 0) - matrix.f) / matrix.a,
  }
}

/** Height of the first input, if it is at the left edge. */
function sideEntry({ input_y, height }: BlockType): number | undefined {
  const [first] = input_y
  return first !== undefined && first > 0 && first < height ? first : undefined
}

/** Distance between the selected block and a new block to its right, px. */
const GAP = 60

/** Add a block by its name: right of the selected block, or else in the middle of the visible part. */
export function addBlock(kind: BlockType): void {
  const { document, selection } = useStudio.getState()
  const blocks = Object.values(document?.blocks ?? {})
  const boxes = blocks.map(({ place: { x, y }, width, height }) => ({ x, y, width, height }))
  const last = blocks.find(({ name }) => selection.has(name))
  const { width, height } = kind
  if (!last) {
    const view = sheetView.visible?.() ?? { x: 0, y: 0, width: 600, height: 400 }
    void insertBlock(kind.type, middleOf(freeInView({ width, height }, view, boxes)), { reveal: true })
    return
  }
  const output = last.outputs.find(({ dx }) => dx > 0)
  const level = last.place.y + (output?.y ?? last.height / 2)
  const y = level - (sideEntry(kind) ?? height / 2)
  const wanted = { x: last.place.x + last.width + GAP, y, width, height }
  const found = freeBelow(wanted, boxes)
  const straight = output ? { level: level + found.y - y } : {}
  void insertBlock(kind.type, middleOf(found), { ...straight, reveal: true })
}

const middleOf = ({ x, y, width, height }: Rectangle) => ({ x: x + width / 2, y: y + height / 2 })
