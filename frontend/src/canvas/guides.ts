import { create } from 'zustand'
import { guided, type Guide, type Guided, type GuideShape } from '../model/guides'
import type { SheetBlock } from '../protocol'

/** The alignments that the present drag shows. */
export const useGuides = create<{ guides: readonly Guide[] }>(() => ({ guides: [] }))

/** Distance within which a dragged block is aligned: on the screen, and its bounds on the sheet, px. */
const REACH = 6
const BOUNDS = [3, 12] as const
/** Number of blocks moved together above which they are not aligned. */
const MOST_MOVED = 20

const NONE: Guided = { dx: 0, dy: 0, guides: [] }

interface Moved {
  id: string
  position: { x: number; y: number }
}

/** The alignment of dragged blocks with all others. */
export function alignment(moved: readonly Moved[], blocks: Record<string, SheetBlock>, zoom: number): Guided {
  const shapes = moved.flatMap(({ id, position }) => (blocks[id] ? [shapeOf(blocks[id], position)] : []))
  if (!shapes.length || moved.length > MOST_MOVED) return NONE
  const names = new Set(moved.map(({ id }) => id))
  const others = Object.values(blocks)
    .filter(({ name }) => !names.has(name))
    .map((block) => shapeOf(block, block.place))
  const reach = Math.min(Math.max(REACH / zoom, BOUNDS[0]), BOUNDS[1])
  return guided(together(shapes), others, reach)
}

function shapeOf({ width, height, inputs, outputs }: SheetBlock, { x, y }: Moved['position']): GuideShape {
  const ports = [
    ...inputs.map((spot) => ({ ...spot, output: false })),
    ...outputs.map((spot) => ({ ...spot, output: true })),
  ]
  return { x, y, width, height, ports: ports.map((port) => ({ ...port, x: x + port.x, y: y + port.y })) }
}

/** Several shapes as one. */
function together(shapes: readonly GuideShape[]): GuideShape {
  const [x, y] = [Math.min(...shapes.map((one) => one.x)), Math.min(...shapes.map((one) => one.y))]
  return {
    x,
    y,
    width: Math.max(...shapes.map((one) => one.x + one.width)) - x,
    height: Math.max(...shapes.map((one) => one.y + one.height)) - y,
    ports: shapes.flatMap(({ ports }) => ports),
  }
}
