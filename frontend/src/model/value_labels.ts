import type { Rectangle } from './free_place'

/** A label at an output: right (or left) of it, above or below its wire. */
export interface LabelPosition {
  below: boolean
  /** Free width, in px of the sheet; labels are cut there, so that they hide no block and no name. */
  width: number
}

/** Distance of the label from the wire, px. */
export const WIRE_DISTANCE = 4
/** Minimum free width above a wire, px; a label with less is placed below if there is more room. */
const MIN_WIDTH_ABOVE = 80
/** Width of a label in a free part of the sheet, px. */
const MAX_WIDTH = 400

/** Width of a letter of a value, and of the space at its sides, px. */
const LETTER_WIDTH = 6
const SIDES = 8
/** Number of digits of a value with enough room. */
const MAX_DIGITS = 4

/**
 * The text of a value with the most digits that fit into a width, px, else an ellipsis. A number that is cut
 * off would be misread: 2.4 instead of 2.4e−15. Vectors are cut off between or after their elements.
 */
export function fittedValue(text: (digits: number) => string, width: number): string {
  const letters = Math.floor((width - SIDES) / LETTER_WIDTH)
  for (let digits = MAX_DIGITS; digits > 0; digits--) {
    const shown = text(digits)
    if (shown.length <= letters || shown.startsWith('[')) return shown
  }
  return '…'
}

/** Choose the place of a label that begins at a point, extends in a direction and has a height. */
export function labelPosition(
  { x, y }: { x: number; y: number },
  direction: 1 | -1,
  { height, scale = 1 }: { height: number; scale?: number },
  obstacles: readonly Rectangle[],
): LabelPosition {
  const above = freeWidth(x, y - WIRE_DISTANCE - height, height, direction, obstacles)
  if (above >= MIN_WIDTH_ABOVE * scale) return { below: false, width: above }
  const below = freeWidth(x, y + WIRE_DISTANCE, height, direction, obstacles)
  return below > above ? { below: true, width: below } : { below: false, width: above }
}

function freeWidth(
  x: number,
  top: number,
  height: number,
  direction: 1 | -1,
  obstacles: readonly Rectangle[],
): number {
  let free = MAX_WIDTH
  for (const obstacle of obstacles) {
    if (obstacle.y >= top + height || obstacle.y + obstacle.height <= top) continue
    const [near, far] =
      direction > 0
        ? [obstacle.x - x, obstacle.x + obstacle.width - x]
        : [x - obstacle.x - obstacle.width, x - obstacle.x]
    if (far > 0) free = Math.min(free, Math.max(near, 0))
  }
  return free
}
