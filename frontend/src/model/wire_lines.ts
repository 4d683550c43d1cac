import type { SheetPort, SheetBlock, Wire, WireLines } from '../protocol'
import { blockOf, portOf, type Places } from './wires'

/** The lines of wires, as routed by the server, and their drawing. */

export type Point = readonly [x: number, y: number]

/** The lines of the wires of a sheet, by source port. */
export type Lines = Readonly<Record<string, WireLines>>

/** A port on the sheet; `dx`, `dy` is the direction away from its block. */
export interface PortPosition {
  x: number
  y: number
  dx: number
  dy: number
}

/** Maximum distance between the end of a line and the centre of its port, px: the router shifts ends to make
 * lines straight. */
const PORT_TOLERANCE = 1.6

/** The positions of both ports of a wire; undefined if one of them does not exist. */
export function endsOf(
  wire: Wire,
  blocks: Record<string, SheetBlock>,
  places: Places,
): [PortPosition, PortPosition] | undefined {
  const from = blocks[blockOf(wire.source)]
  const to = blocks[blockOf(wire.target)]
  const source = from?.outputs.find(({ name }) => name === portOf(wire.source))
  const target = to?.inputs.find(({ name }) => name === portOf(wire.target))
  if (!from || !to || !source || !target) return undefined
  return [
    portPosition(source, places[from.name] ?? from.place, 1),
    portPosition(target, places[to.name] ?? to.place, -1),
  ]
}

const portPosition = (port: SheetPort, at: { x: number; y: number }, sign: number): PortPosition => ({
  x: at.x + port.x,
  y: at.y + port.y,
  dx: sign * port.dx,
  dy: sign * port.dy,
})

/** Whether a path ends at its ports; a path that branches from another one may begin anywhere. */
export function endsAtPorts(
  path: readonly Point[],
  isBranch: boolean,
  ends: [PortPosition, PortPosition],
): boolean {
  const [first, last] = [path[0], path.at(-1)]
  return Boolean(first && last) && (isBranch || isNear(first!, ends[0])) && isNear(last!, ends[1])
}

const isNear = ([x, y]: Point, port: PortPosition) =>
  Math.abs(x - port.x) <= PORT_TOLERANCE && Math.abs(y - port.y) <= PORT_TOLERANCE

/**
 * A path whose ends follow ports that have moved since it was routed: the outer segments are stretched.
 * Without a path, a straight line between the ports. Used as a preview until the server has routed the wire
 * again.
 */
export function stretchedToPorts(
  path: readonly Point[],
  isBranch: boolean,
  ends: [PortPosition, PortPosition],
): Point[] {
  if (path.length < 2) return [pointOf(ends[0]), pointOf(ends[1])]
  const points = [...path]
  const horizontal = isHorizontal(points, 0)
  if (points.length < 4) {
    const [[ax, ay], [bx, by]] = [isBranch ? points[0]! : pointOf(ends[0]), pointOf(ends[1])]
    const [mx, my] = [(ax + bx) / 2, (ay + by) / 2]
    return corners(
      horizontal
        ? [
            [ax, ay],
            [mx, ay],
            [mx, by],
            [bx, by],
          ]
        : [
            [ax, ay],
            [ax, my],
            [bx, my],
            [bx, by],
          ],
    )
  }
  const stretched = withLastPoint(points, pointOf(ends[1]))
  return corners(isBranch ? stretched : withLastPoint(stretched.reverse(), pointOf(ends[0])).reverse())
}

/** A path with another last point; the last segment keeps its direction. */
function withLastPoint(path: Point[], end: Point): Point[] {
  const horizontal = isHorizontal(path, path.length - 2)
  const [x, y] = path.at(-2)!
  return [...path.slice(0, -2), horizontal ? [x, end[1]] : [end[0], y], end]
}

const pointOf = ({ x, y }: PortPosition): Point => [x, y]

export const isHorizontal = (path: readonly Point[], segment: number): boolean =>
  path[segment]![1] === path[segment + 1]![1]

/** The points without repetitions and without points on a straight line between their neighbours. */
export function corners(points: Point[]): Point[] {
  const result: Point[] = []
  for (const point of points) {
    const last = result.at(-1)
    if (last && last[0] === point[0] && last[1] === point[1]) continue
    const before = result.at(-2)
    if (
      last &&
      before &&
      ((before[0] === last[0] && last[0] === point[0]) || (before[1] === last[1] && last[1] === point[1]))
    )
      result[result.length - 1] = point
    else result.push(point)
  }
  return result
}

/** Radius of the round corners, px. */
const CORNER_RADIUS = 5

/** The path as SVG: straight segments with round corners, but sharp corners at branches (`dots`). */
export function svgPath(points: readonly Point[], dots: readonly Point[] = []): string {
  const [first] = points
  if (!first) return ''
  let text = `M${first[0]} ${first[1]}`
  for (let k = 1; k < points.length - 1; k++) {
    const [before, corner, after] = [points[k - 1]!, points[k]!, points[k + 1]!]
    if (dots.some(([x, y]) => x === corner[0] && y === corner[1])) {
      text += `L${corner[0]} ${corner[1]}`
      continue
    }
    const radius = Math.min(CORNER_RADIUS, length(before, corner) / 2, length(corner, after) / 2)
    const [ax, ay] = pointTowards(corner, before, radius)
    const [bx, by] = pointTowards(corner, after, radius)
    text += `L${ax} ${ay}Q${corner[0]} ${corner[1]} ${bx} ${by}`
  }
  const last = points.at(-1)!
  return `${text}L${last[0]} ${last[1]}`
}

/** The distance of two points on a horizontal or vertical segment, px. */
const length = (a: Point, b: Point) => Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1])

function pointTowards(a: Point, b: Point, distance: number): Point {
  const fraction = distance / (length(a, b) || 1)
  return [a[0] + (b[0] - a[0]) * fraction, a[1] + (b[1] - a[1]) * fraction]
}
