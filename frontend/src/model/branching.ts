import type { SheetBlock } from '../protocol'
import type { Point } from './wire_lines'

/** The point of a path that is nearest to a point. */
export function nearestOn(path: readonly Point[], [x, y]: Point): Point {
  let best: Point = path[0] ?? [x, y]
  let least = Infinity
  for (let k = 1; k < path.length; k++) {
    const [[ax, ay], [bx, by]] = [path[k - 1]!, path[k]!]
    const size = (bx - ax) ** 2 + (by - ay) ** 2
    const part = size ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / size, 0), 1) : 0
    const point: Point = [ax + part * (bx - ax), ay + part * (by - ay)]
    const distance = Math.hypot(point[0] - x, point[1] - y)
    if (distance < least) [least, best] = [distance, point]
  }
  return best
}

/** An input and its position. */
export interface InputPlace {
  port: string
  at: Point
}

/** The input within a distance (px) that is nearest to a point; undefined if there is none. */
export function nearestInput(
  blocks: Iterable<Pick<SheetBlock, 'name' | 'place' | 'inputs'>>,
  [x, y]: Point,
  within: number,
): InputPlace | undefined {
  let best: InputPlace | undefined
  let least = within
  for (const { name, place, inputs } of blocks)
    for (const spot of inputs) {
      const at: Point = [place.x + spot.x, place.y + spot.y]
      const distance = Math.hypot(at[0] - x, at[1] - y)
      if (distance <= least) [least, best] = [distance, { port: `${name}/${spot.name}`, at }]
    }
  return best
}
