import type { Rectangle } from './free_place'

/** The dragged corner: -1 is left or upper, 1 is right or lower. */
export type Corner = readonly [x: -1 | 1, y: -1 | 1]

const GRID = 5
const MIN_SIZE = 20
/** Distance between ports, px. */
const PORT_PITCH = 10

/** A block whose corner was dragged by a distance; the opposite corner stays, sizes are on the grid. */
export function resized(
  { x, y, width, height }: Rectangle,
  [right, down]: Corner,
  shift: { x: number; y: number },
  ports: number,
): Rectangle {
  const newWidth = Math.max(GRID * Math.round((width + right * shift.x) / GRID), MIN_SIZE)
  const newHeight = Math.max(
    GRID * Math.round((height + down * shift.y) / GRID),
    MIN_SIZE,
    PORT_PITCH * ports,
  )
  return {
    x: right < 0 ? x + width - newWidth : x,
    y: down < 0 ? y + height - newHeight : y,
    width: newWidth,
    height: newHeight,
  }
}
