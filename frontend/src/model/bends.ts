import type { WireLines } from '../protocol'
import { corners, isFlat, type Point } from './wire_lines'

/**
 * User-drawn routes: the dragged segments of a wire are stored as `bends`, the alternating coordinates of
 * the segments (see `bent` in `armblocks.drawing.wires`).
 */

const STUB = 15

/** The complete route to a target: its own path, preceded by the part shared with another path. */
export function wholeWay(
  net: WireLines,
  target: string,
  seen: ReadonlySet<string> = new Set([target]),
): Point[] {
  const own = net.paths[target] ?? []
  const [start] = own
  if (!start) return []
  for (const [other, path] of Object.entries(net.paths)) {
    if (seen.has(other)) continue
    for (let k = 1; k < path.length; k++)
      if (lies(start, path[k - 1]!, path[k]!) && !same(start, path[0]!)) {
        const before = wholeWay(net, other, new Set([...seen, other])).slice(0, -(path.length - k))
        return corners([...before, start, ...own])
      }
  }
  return [...own]
}

const same = (a: Point, b: Point) => a[0] === b[0] && a[1] === b[1]

function lies(p: Point, a: Point, b: Point): boolean {
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
function pieces(way: readonly Point[]): number[] {
  const between: number[] = []
  for (let k = 1; k < way.length - 2; k++) between.push(isFlat(way, k) ? way[k]![1] : way[k]![0])
  return between
}

/**
 * The bends after segment `piece` of a route was dragged to `level`. A segment at a port keeps a short part
 * at the port and continues with a step to the level, because the port does not move.
 */
export function dragged(way: readonly Point[], piece: number, level: number): number[] {
  const between = pieces(way)
  const last = way.length - 2
  if (piece > 0 && piece < last) {
    between[piece - 1] = level
    return straightened(between)
  }
  const axis = isFlat(way, piece) ? 0 : 1
  const along = (from: Point, to: Point) => from[axis] + STUB * Math.sign(to[axis] - from[axis])
  const leaving = along(way[0]!, way[1]!)
  const arriving = along(way[last + 1]!, way[last]!)
  if (last === 0) return [leaving, level, arriving]
  return straightened(piece === 0 ? [leaving, level, ...between] : [...between, level, arriving])
}

/** Remove steps of zero length. */
function straightened(bends: number[]): number[] {
  const kept = [...bends]
  for (let k = 0; k + 2 < kept.length; k++)
    if (Math.abs(kept[k]! - kept[k + 2]!) < 1e-6 && kept.length > 2) {
      kept.splice(k + 1, 2)
      k--
    }
  return kept
}
