import type { SheetBlock, Wire } from '../protocol'
import { blockOf, throughPorts, wireKey, type Places } from './wires'
import type { Point } from './wire_lines'

/** Disconnecting blocks from wires and inserting them into wires: the resulting changes of the wires. */

/** Distance from a wire within which a dropped block is inserted into it, px. */
const INSERT_DISTANCE = 12
/** Length of wire on both sides of an inserted block; on shorter segments the block is centred, px. */
const WIRE_MARGIN = 60

/** Whether a block has no wires, so that dropping it on a wire inserts it. */
export function isInsertable(block: SheetBlock, wires: Wire[]): boolean {
  return (
    block.inputs.length > 0 &&
    block.outputs.length > 0 &&
    !wires.some(({ source, target }) => blockOf(source) === block.name || blockOf(target) === block.name)
  )
}

/**
 * The wires without the wires between some blocks and all other blocks. The two neighbours of a single block
 * with one input and one output are connected.
 */
export function disconnectBlocks(blocks: SheetBlock[], wires: Wire[]): Wire[] {
  const names = new Set(blocks.map(({ name }) => name))
  const isUncut = ({ source, target }: Wire) => names.has(blockOf(source)) === names.has(blockOf(target))
  const remaining = wires.filter(isUncut)
  const [block] = blocks
  if (blocks.length !== 1 || block?.inputs.length !== 1 || block.outputs.length !== 1) return remaining
  const cutWires = wires.filter((wire) => !isUncut(wire))
  const driver = cutWires.find(({ target }) => names.has(blockOf(target)))
  if (!driver) return remaining
  const driven = cutWires.filter(({ source }) => names.has(blockOf(source)))
  return [...remaining, ...driven.map(({ target }) => ({ source: driver.source, target }))]
}

/** The wires after inserting a block into one of them, with its first input and output or its frame ports. */
export function insertIntoWire(block: SheetBlock, { wire, frame }: InsertionPlace, wires: Wire[]): Wire[] {
  const [input, output] = throughPorts(block, frame)
  if (!input || !output) return wires
  const others = wires.filter((other) => wireKey(other) !== wireKey(wire))
  return [
    ...others,
    { source: wire.source, target: `${block.name}/${input.name}` },
    { source: `${block.name}/${output.name}`, target: wire.target },
  ]
}

/** The edit that changes one list of wires into another. */
export function wireDifference(before: Wire[], after: Wire[]): { wires: Wire[]; instead: Wire[] } {
  const [old, next] = [new Set(before.map(wireKey)), new Set(after.map(wireKey))]
  return {
    wires: after.filter((wire) => !old.has(wireKey(wire))),
    instead: before.filter((wire) => !next.has(wireKey(wire))),
  }
}

/** A wire, and whether it is a frame line. */
export interface InsertionPlace {
  wire: Wire
  frame: boolean
}

/** A horizontal segment of a wire: its height, its ends, and whether it runs to the left. */
interface WireSegment extends InsertionPlace {
  y: number
  left: number
  right: number
  flipped: boolean
}

/** A drawn wire: the block and port of its ends, and its corner points. */
interface DrawnWire {
  id: string
  source: string
  sourceHandle?: string | null
  target: string
  targetHandle?: string | null
  data?: { path: readonly Point[]; frame?: boolean }
}

/** The horizontal segment of an existing wire under a point. */
export function wireAt(
  at: { x: number; y: number },
  edges: readonly DrawnWire[],
  wires: Wire[],
): WireSegment | undefined {
  const present = new Set(wires.map(wireKey))
  for (const { id, source, sourceHandle, target, targetHandle, data } of edges) {
    // Skip the preview of a wire between the former neighbours of a disconnected block.
    if (!present.has(id)) continue
    const path = data?.path ?? []
    for (let k = 1; k < path.length; k++) {
      const [[ax, ay], [bx, by]] = [path[k - 1]!, path[k]!]
      const [left, right] = [Math.min(ax, bx), Math.max(ax, bx)]
      if (ay === by && Math.abs(at.y - ay) < INSERT_DISTANCE && at.x > left && at.x < right)
        return {
          wire: { source: `${source}/${sourceHandle}`, target: `${target}/${targetHandle}` },
          frame: Boolean(data?.frame),
          y: ay,
          left,
          right,
          flipped: ax > bx,
        }
    }
  }
  return undefined
}

/** The segment at a point into which a block can be inserted: it has ports of the kind of the wire. */
export function insertionAt(
  block: SheetBlock,
  at: { x: number; y: number },
  edges: readonly DrawnWire[],
  wires: Wire[],
): WireSegment | undefined {
  const segment = wireAt(at, edges, wires)
  return segment && throughPorts(block, segment.frame).every(Boolean) ? segment : undefined
}

/**
 * The position of a block at which a wire runs straight into its first input, in the direction of the wire;
 * on a short segment the block is centred.
 */
export function alignedPosition(
  block: SheetBlock,
  at: { x: number; y: number },
  { y, left, right, flipped, frame }: WireSegment,
): Places[string] {
  const [input] = throughPorts(block, frame)
  if (input?.dy !== 0) return at
  const narrow = right - left < block.width + WIRE_MARGIN
  return { x: narrow ? (left + right - block.width) / 2 : at.x, y: y - input.y, flipped }
}
