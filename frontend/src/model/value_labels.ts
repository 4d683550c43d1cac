import type { Rectangle } from './free_place'

/** A label at an output: right (or left) of it, above or below its wire. */
export interface LabelPlace {
  below: boolean
  /** Free width, in px of the sheet; labels are cut there, so that they hide no block and no name. */
  width: number
}

/** Distance of the label from the wire, px. */
export const OFF_WIRE = 4
/** A label that is narrower is placed below the wire if there is more room. */
const ENOUGH = 80
/** Width of a label in a free part of the sheet, px. */
const MOST = 400

/** Choose the place of a label that begins at a point, extends in a direction and has a height. */
export function labelPlace(
  { x, y }: { x: number; y: number },
  direction: 1 | -1,
  { height, legible = 1 }: { height: number; legible?: number },
  obstacles: readonly Rectangle[],
): LabelPlace {
  const above = freeWidth(x, y - OFF_WIRE - height, height, direction, obstacles)
  if (above >= ENOUGH * legible) return { below: false, width: above }
  const below = freeWidth(x, y + OFF_WIRE, height, direction, obstacles)
  return below > above ? { below: true, width: below } : { below: false, width: above }
}

function freeWidth(
  x: number,
  top: number,
  height: number,
  direction: 1 | -1,
  obstacles: readonly Rectangle[],
): number {
  let free = MOST
  for (const one of obstacles) {
    if (one.y >= top + height || one.y + one.height <= top) continue
    const [near, far] =
      direction > 0 ? [one.x - x, one.x + one.width - x] : [x - one.x - one.width, x - one.x]
    if (far > 0) free = Math.min(free, Math.max(near, 0))
  }
  return free
}
