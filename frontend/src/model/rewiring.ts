import type { SheetBlock, Wire } from '../protocol'
import { blockOf, wireKey, type Places } from './wires'
import type { Point } from './router'

/** Removal of blocks from wires and insertion into wires: the changes of a sheet's wires. */

/** px from a wire at which a block that is dropped goes into it. */
const INTO_WIRE = 12
/** px of wire beside a block that make it stand in the middle where there are no more. */
const ROOM = 60

/** Whether a block can be inserted into a wire. */
const passes = (block: SheetBlock): boolean => block.inputs.length > 0 && block.outputs.length > 0

/** Whether a block has no wires, so that it can be inserted into a wire by dropping it there. */
export function isLoose(block: SheetBlock, wires: Wire[]): boolean {
  return (
    passes(block) &&
    !wires.some(({ source, target }) => blockOf(source) === block.name || blockOf(target) === block.name)
  )
}

/**
 * The wires without those between some blocks and all others; where that is one block with one input and one
 * output they close behind it.
 */
export function takenOut(blocks: SheetBlock[], wires: Wire[]): Wire[] {
  const names = new Set(blocks.map(({ name }) => name))
  const within = ({ source, target }: Wire) => names.has(blockOf(source)) === names.has(blockOf(target))
  const left = wires.filter(within)
  const [block] = blocks
  if (blocks.length !== 1 || block?.inputs.length !== 1 || block.outputs.length !== 1) return left
  const cut = wires.filter((wire) => !within(wire))
  const driver = cut.find(({ target }) => names.has(blockOf(target)))
  if (!driver) return left
  const driven = cut.filter(({ source }) => names.has(blockOf(source)))
  return [...left, ...driven.map(({ target }) => ({ source: driver.source, target }))]
}

/** The wires after the insertion of a block into one of them, by its first input and first output. */
export function putInto(block: SheetBlock, wire: Wire, wires: Wire[]): Wire[] {
  const [input, output] = [block.inputs[0], block.outputs[0]]
  if (!input || !output) return wires
  const others = wires.filter((other) => wireKey(other) !== wireKey(wire))
  return [
    ...others,
    { source: wire.source, target: `${block.name}/${input.name}` },
    { source: `${block.name}/${output.name}`, target: wire.target },
  ]
}

/** The edit that turns one list of wires into another. */
export function rewired(before: Wire[], after: Wire[]): { wires: Wire[]; instead: Wire[] } {
  const [old, next] = [new Set(before.map(wireKey)), new Set(after.map(wireKey))]
  return {
    wires: after.filter((wire) => !old.has(wireKey(wire))),
    instead: before.filter((wire) => !next.has(wireKey(wire))),
  }
}

/** A level piece of a wire: its height and its ends, and whether it runs to the left. */
interface Piece {
  wire: Wire
  y: number
  left: number
  right: number
  flipped: boolean
}

/** A wire as it is drawn: its ends by block and port, and its corner points. */
interface DrawnWire {
  id: string
  source: string
  sourceHandle?: string | null
  target: string
  targetHandle?: string | null
  data?: { path: readonly Point[] }
}

/** The horizontal segment under a point, of the existing wires. */
export function wireAt(
  at: { x: number; y: number },
  edges: readonly DrawnWire[],
  wires: Wire[],
): Piece | undefined {
  const present = new Set(wires.map(wireKey))
  for (const { id, source, sourceHandle, target, targetHandle, data } of edges) {
    // A wire that has just been reconnected does not take the block again.
    if (!present.has(id)) continue
    const path = data?.path ?? []
    for (let k = 1; k < path.length; k++) {
      const [[ax, ay], [bx, by]] = [path[k - 1]!, path[k]!]
      const [left, right] = [Math.min(ax, bx), Math.max(ax, bx)]
      if (ay === by && Math.abs(at.y - ay) < INTO_WIRE && at.x > left && at.x < right)
        return {
          wire: { source: `${source}/${sourceHandle}`, target: `${target}/${targetHandle}` },
          y: ay,
          left,
          right,
          flipped: ax > bx,
        }
    }
  }
  return undefined
}

/**
 * Where a block stands so that a wire runs straight into its first input, and through it the way that the
 * wire goes; where there is little room, in the middle of it.
 */
export function levelled(
  block: SheetBlock,
  at: { x: number; y: number },
  { y, left, right, flipped }: Piece,
): Places[string] {
  const input = block.inputs[0]
  if (input?.dy !== 0) return at
  const narrow = right - left < block.width + ROOM
  return { x: narrow ? (left + right - block.width) / 2 : at.x, y: y - input.y, flipped }
}
