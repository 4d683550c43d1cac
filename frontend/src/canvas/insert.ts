import { freeBelow, freeInView, type Rectangle } from '../model/free_place'
import type { BlockType, Place, Wire } from '../protocol'
import { change, freeName, useStudio } from '../store'
import { sheetView } from './sheet_actions'

/** Drag data from the library: a block type. */
export const BLOCK_TYPE = 'application/x-armblocks-block'

/** Grid of block positions, px. */
export const GRID = 5

/**
 * Add a new block of a type with its centre at a point, and select it. With a wire the block is inserted into
 * it. `level`: the height of the wire that enters its first input, which is then exactly straight.
 */
export function insertBlock(
  type: string,
  at: { x: number; y: number },
  { wire, level }: { wire?: Wire; level?: number } = {},
): void {
  const { document, library, select } = useStudio.getState()
  const kind = library.get(type)
  if (!document || !kind) return
  const name = freeName(kind.title.replace(/[/.]/g, ' '), Object.keys(document.blocks))
  const entry = level === undefined ? undefined : sideEntry(kind)
  const place: Place = {
    x: GRID * Math.round((at.x - kind.width / 2) / GRID),
    y: entry === undefined ? GRID * Math.round((at.y - kind.height / 2) / GRID) : level! - entry,
  }
  const [input, output] = [kind.inputs[0], kind.outputs[0]]
  const between = wire && input && output
  void change({
    kind: 'add',
    blocks: [{ name, type, place }],
    wires: between
      ? [
          { source: wire.source, target: `${name}/${input}` },
          { source: `${name}/${output}`, target: wire.target },
        ]
      : [],
    instead: between ? [wire] : [],
  }).then((version) => {
    if (version === undefined) return
    select([name])
    sheetView.reveal?.({ ...place, width: kind.width, height: kind.height })
  })
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
    insertBlock(kind.type, middleOf(freeInView({ width, height }, view, boxes)))
    return
  }
  const output = last.outputs.find(({ dx }) => dx > 0)
  const level = last.place.y + (output?.y ?? last.height / 2)
  const y = level - (sideEntry(kind) ?? height / 2)
  const wanted = { x: last.place.x + last.width + GAP, y, width, height }
  const found = freeBelow(wanted, boxes)
  insertBlock(kind.type, middleOf(found), output ? { level: level + found.y - y } : {})
}

const middleOf = ({ x, y, width, height }: Rectangle) => ({ x: x + width / 2, y: y + height / 2 })
