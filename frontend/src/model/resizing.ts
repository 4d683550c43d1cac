import type { Rectangle } from './free_place'

/** The dragged corner: -1 is left or upper, 1 is right or lower. */
export type Corner = readonly [x: -1 | 1, y: -1 | 1]

const GRID = 5
const LEAST = 20
/** Distance of ports, px. */
const PITCH = 10

/** A block whose corner was dragged by a distance; the opposite corner stays, sizes are on the grid. */
export function resized(
  { x, y, width, height }: Rectangle,
  [right, down]: Corner,
  by: { x: number; y: number },
  ports: number,
): Rectangle {
  const wide = Math.max(GRID * Math.round((width + right * by.x) / GRID), LEAST)
  const high = Math.max(GRID * Math.round((height + down * by.y) / GRID), LEAST, PITCH * ports)
  return {
    x: right < 0 ? x + width - wide : x,
    y: down < 0 ? y + height - high : y,
    width: wide,
    height: high,
  }
}
