import type { SheetBlock } from '../protocol'
import type { Point } from './wire_lines'

/** The point of a path that is nearest to a point. */
export function nearestPointOn(path: readonly Point[], [x, y]: Point): Point {
  let nearest: Point = path[0] ?? [x, y]
  let shortest = Infinity
  for (let k = 1; k < path.length; k++) {
    const [[ax, ay], [bx, by]] = [path[k - 1]!, path[k]!]
    const lengthSquared = (bx - ax) ** 2 + (by - ay) ** 2
    const fraction = lengthSquared
      ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / lengthSquared, 0), 1)
      : 0
    const point: Point = [ax + fraction * (bx - ax), ay + fraction * (by - ay)]
    const distance = Math.hypot(point[0] - x, point[1] - y)
    if (distance < shortest) [shortest, nearest] = [distance, point]
  }
  return nearest
}

/** An input and its position. */
export interface InputPosition {
  port: string
  at: Point
}

/** The input or frame port within a distance (px) that is nearest to a point; undefined if there is none. */
export function nearestInput(
  blocks: Iterable<Pick<SheetBlock, 'name' | 'place' | 'inputs'>>,
  [x, y]: Point,
  maxDistance: number,
  frame = false,
): InputPosition | undefined {
  let nearest: InputPosition | undefined
  let shortest = maxDistance
  for (const { name, place, inputs } of blocks)
    for (const port of inputs) {
      if (Boolean(port.frame) !== frame) continue
      const position: Point = [place.x + port.x, place.y + port.y]
      const distance = Math.hypot(position[0] - x, position[1] - y)
      if (distance <= shortest)
        [shortest, nearest] = [distance, { port: `${name}/${port.name}`, at: position }]
    }
  return nearest
}
