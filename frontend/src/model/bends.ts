import type { WireLines } from '../protocol'
import { corners, isHorizontal, type Point } from './wire_lines'

/**
 * User-drawn routes: the dragged segments of a wire are stored as `bends`, the alternating coordinates of
 * the segments (see `bent` in `armblocks.drawing.wires`).
 */

/** Length of the part of a dragged segment that remains at its port, px. */
const STUB = 15

/** The complete route to a target: its own path, preceded by the part shared with another path. */
export function completeRoute(
  net: WireLines,
  target: string,
  visited: ReadonlySet<string> = new Set([target]),
): Point[] {
  const ownPath = net.paths[target] ?? []
  const [start] = ownPath
  if (!start) return []
  for (const [other, path] of Object.entries(net.paths)) {
    if (visited.has(other)) continue
    for (let k = 1; k < path.length; k++)
      if (isOnSegment(start, path[k - 1]!, path[k]!) && !equal(start, path[0]!)) {
        const before = completeRoute(net, other, new Set([...visited, other])).slice(0, -(path.length - k))
        return corners([...before, start, ...ownPath])
      }
  }
  return [...ownPath]
}

const equal = (a: Point, b: Point) => a[0] === b[0] && a[1] === b[1]

function isOnSegment(p: Point, a: Point, b: Point): boolean {
  return (
    Math.min(a[0], b[0]) <= p[0] &&
    p[0] <= Math.max(a[0], b[0]) &&
    Math.min(a[1], b[1]) <= p[1] &&
    p[1] <= Math.max(a[1], b[1])
  )
}

/**
 * The coordinates of the segments between the first, which moves with the source, and the last, which moves
 * with the target.
 */
function innerCoordinates(route: readonly Point[]): number[] {
  const inner: number[] = []
  for (let k = 1; k < route.length - 2; k++) inner.push(isHorizontal(route, k) ? route[k]![1] : route[k]![0])
  return inner
}

/**
 * The bends after a `segment` of a route was dragged to `level`. A segment at a port keeps a short part
 * at the port and continues with a step to the level, because the port does not move.
 */
export function dragged(route: readonly Point[], segment: number, level: number): number[] {
  const inner = innerCoordinates(route)
  const last = route.length - 2
  if (segment > 0 && segment < last) {
    inner[segment - 1] = level
    return straightened(inner)
  }
  const axis = isHorizontal(route, segment) ? 0 : 1
  const along = (from: Point, to: Point) => from[axis] + STUB * Math.sign(to[axis] - from[axis])
  const leaving = along(route[0]!, route[1]!)
  const arriving = along(route[last + 1]!, route[last]!)
  if (last === 0) return [leaving, level, arriving]
  return straightened(segment === 0 ? [leaving, level, ...inner] : [...inner, level, arriving])
}

/** Remove steps of zero length. */
function straightened(bends: number[]): number[] {
  const result = [...bends]
  for (let k = 0; k + 2 < result.length; k++)
    if (Math.abs(result[k]! - result[k + 2]!) < 1e-6 && result.length > 2) {
      result.splice(k + 1, 2)
      k--
    }
  return result
}
