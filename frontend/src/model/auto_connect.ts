import type { SheetBlock, SheetPort, Wire } from '../protocol'
import type { PortPosition } from './wire_lines'
import { blockOf } from './wires'

/** The proposed connection of a block that is placed directly in front of an unconnected port. */

/** Maximum length of a proposed line, from port to port, px. */
const REACH = 100
/** Maximum distance of a port from the straight line through the other port, px. */
const MAX_OFFSET = 20

/** A block at the position where it would be placed. */
export type PlacedBlock = Omit<SheetBlock, 'place'> & { place: { x: number; y: number } }

/** A proposed wire, and the positions of its ports. */
export interface ProposedWire {
  wire: Wire
  ends: [PortPosition, PortPosition]
}

interface PlacedPort {
  ref: string
  x: number
  y: number
  port: SheetPort
}

/**
 * The wire between an unconnected port of a placed block and the nearest unconnected port of another block
 * that faces it, at most `REACH` px away, with no third block between them. Frame ports are connected with
 * frame ports only.
 */
export function proposedWire(
  placed: PlacedBlock,
  blocks: readonly SheetBlock[],
  wires: readonly Wire[],
): ProposedWire | undefined {
  const connected = new Set(wires.flatMap(({ source, target }) => [source, target]))
  const isFree = ({ ref }: PlacedPort) => !connected.has(ref)
  const [inputs, outputs] = [placed.inputs, placed.outputs].map((ports) =>
    placedPorts(placed.name, placed.place, ports).filter(isFree),
  ) as [PlacedPort[], PlacedPort[]]
  let best: { distance: number; proposed: ProposedWire } | undefined
  const consider = (source: PlacedPort, target: PlacedPort) => {
    const distance = facingDistance(source, target)
    if (distance === undefined || (best && best.distance <= distance)) return
    const obstacles = blocks.filter(({ name }) => ![source, target].some(({ ref }) => blockOf(ref) === name))
    if (obstacles.some((block) => isBetween(block, source, target))) return
    const { dx, dy } = source.port
    const ends: ProposedWire['ends'] = [
      { x: source.x, y: source.y, dx, dy },
      { x: target.x, y: target.y, dx: -dx, dy: -dy },
    ]
    best = { distance, proposed: { wire: { source: source.ref, target: target.ref }, ends } }
  }
  for (const block of blocks) {
    if (block.name === placed.name || !isNear(block, placed)) continue
    const [otherInputs, otherOutputs] = [block.inputs, block.outputs].map((ports) =>
      placedPorts(block.name, block.place, ports).filter(isFree),
    ) as [PlacedPort[], PlacedPort[]]
    for (const output of outputs) for (const input of otherInputs) consider(output, input)
    for (const output of otherOutputs) for (const input of inputs) consider(output, input)
  }
  return best?.proposed
}

/** Whether a line between ports of two blocks may be short enough. */
const isNear = (a: PlacedBlock, b: PlacedBlock): boolean =>
  a.place.x < b.place.x + b.width + REACH &&
  b.place.x < a.place.x + a.width + REACH &&
  a.place.y < b.place.y + b.height + REACH &&
  b.place.y < a.place.y + a.height + REACH

const placedPorts = (name: string, at: { x: number; y: number }, ports: readonly SheetPort[]): PlacedPort[] =>
  ports.map((port) => ({ ref: `${name}/${port.name}`, x: at.x + port.x, y: at.y + port.y, port }))

/** Whether a block covers a part of the rectangle between two ports. */
const isBetween = ({ place, width, height }: SheetBlock, a: PlacedPort, b: PlacedPort): boolean =>
  Math.min(a.x, b.x) < place.x + width &&
  Math.max(a.x, b.x) > place.x &&
  Math.min(a.y, b.y) < place.y + height &&
  Math.max(a.y, b.y) > place.y

/** The length of the line between two ports that face each other; undefined if they do not. */
function facingDistance(source: PlacedPort, target: PlacedPort): number | undefined {
  const { dx, dy } = source.port
  if (Boolean(source.port.frame) !== Boolean(target.port.frame)) return undefined
  if (dx !== target.port.dx || dy !== target.port.dy) return undefined
  const along = (target.x - source.x) * dx + (target.y - source.y) * dy
  const across = Math.abs((target.x - source.x) * dy) + Math.abs((target.y - source.y) * dx)
  return along > 0 && along <= REACH && across <= MAX_OFFSET ? along + across : undefined
}
