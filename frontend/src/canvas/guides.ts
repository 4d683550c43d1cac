import { create } from 'zustand'
import { align, type Guide, type Alignment, type GuideShape } from '../model/guides'
import type { SheetBlock } from '../protocol'

/** The alignments that the present drag shows. */
export const useGuides = create<{ guides: readonly Guide[] }>(() => ({ guides: [] }))

/** Distance within which a dragged block is aligned: on the screen, and its bounds on the sheet, px. */
const REACH = 6
const REACH_BOUNDS = [3, 12] as const
/** Number of blocks moved together above which they are not aligned. */
const MAX_MOVED = 20

const NOT_ALIGNED: Alignment = { dx: 0, dy: 0, guides: [] }

interface MovedNode {
  id: string
  position: { x: number; y: number }
}

/** The alignment of dragged blocks with all other blocks. */
export function alignment(
  moved: readonly MovedNode[],
  blocks: Record<string, SheetBlock>,
  zoom: number,
): Alignment {
  const shapes = moved.flatMap(({ id, position }) => (blocks[id] ? [shapeOf(blocks[id], position)] : []))
  if (!shapes.length || moved.length > MAX_MOVED) return NOT_ALIGNED
  const names = new Set(moved.map(({ id }) => id))
  const others = Object.values(blocks)
    .filter(({ name }) => !names.has(name))
    .map((block) => shapeOf(block, block.place))
  const reach = Math.min(Math.max(REACH / zoom, REACH_BOUNDS[0]), REACH_BOUNDS[1])
  return align(boundingShape(shapes), others, reach)
}

function shapeOf(
  { width, height, inputs, outputs }: SheetBlock,
  { x, y }: MovedNode['position'],
): GuideShape {
  const ports = [
    ...inputs.map((port) => ({ ...port, output: false })),
    ...outputs.map((port) => ({ ...port, output: true })),
  ]
  return { x, y, width, height, ports: ports.map((port) => ({ ...port, x: x + port.x, y: y + port.y })) }
}

/** Several shapes as one. */
function boundingShape(shapes: readonly GuideShape[]): GuideShape {
  const [x, y] = [Math.min(...shapes.map((shape) => shape.x)), Math.min(...shapes.map((shape) => shape.y))]
  return {
    x,
    y,
    width: Math.max(...shapes.map((shape) => shape.x + shape.width)) - x,
    height: Math.max(...shapes.map((shape) => shape.y + shape.height)) - y,
    ports: shapes.flatMap(({ ports }) => ports),
  }
}
