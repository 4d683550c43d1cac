import type { Rectangle } from './free_place'
import type { Point } from './wire_lines'

/** The values that are shown at wires: their texts and places. */

/** The label of the value of an output. */
export interface ValueLabel {
  /** The port; `direction` is 1 if its wire leads to the right, −1 if it leads to the left. */
  x: number
  y: number
  direction: 1 | -1
  /** The lines of the wire. */
  paths: readonly (readonly Point[])[]
  /** The width for the usual texts of the value, px of the screen. */
  width: number
}

/** A label that begins at `x` and extends in a direction: its upper edge and width, px of the sheet. */
export interface PlacedLabel {
  x: number
  top: number
  direction: 1 | -1
  width: number
}

/** Distance of the label from the wire, px. */
const WIRE_DISTANCE = 4
/** Distance of the label from the port or the corner at which its segment begins, px. */
const END_DISTANCE = 6
/** Minimum free width, as part of the wanted width; a label with less is placed where it has more room. */
const MIN_PART = 0.75

/** Width of a letter of a value, and of the space at its sides, px. */
const LETTER_WIDTH = 6
const SIDES = 8
/** Number of digits of a value with enough room, and the least number for which all elements are shown. */
const MAX_DIGITS = 4
const MIN_DIGITS = 2
/** Number of letters of a scalar with its unit, and of one of several elements. */
const SCALAR_LETTERS = 16
const ELEMENT_LETTERS = 9

/** The width of the label of a value with a number of shown elements, px. */
export const labelWidth = (elements: number): number =>
  SIDES + LETTER_WIDTH * (elements > 1 ? 2 + ELEMENT_LETTERS * elements : SCALAR_LETTERS)

/**
 * The text of a value with the most digits that fit into a width, px, else with fewer elements, else an
 * ellipsis. A number that is cut off would be misread: 2.4 instead of 2.4e−15.
 */
export function fittedValue(
  text: (digits: number, elements: number) => string,
  width: number,
  elements = 1,
): string {
  const letters = Math.floor((width - SIDES) / LETTER_WIDTH)
  for (let count = elements; count > 0; count--)
    for (let digits = MAX_DIGITS; digits >= (count > 1 ? MIN_DIGITS : 1); digits--) {
      const shown = text(digits, count)
      if (shown.length <= letters) return shown
    }
  return '…'
}

/**
 * Place labels one after the other, so that none covers a block, a name or an earlier label: in front of the
 * port above or below its wire, else beside another segment of the wire. The places do not depend on the
 * values, so the labels are still while the values change.
 */
export function placeLabels(
  labels: readonly ValueLabel[],
  { height, scale }: { height: number; scale: number },
  obstacles: readonly Rectangle[],
): PlacedLabel[] {
  const occupied = [...obstacles]
  return labels.map((label) => {
    const wanted = label.width * scale
    let best: PlacedLabel | undefined
    for (const { x, top, direction, room } of candidates(label, height)) {
      const width = Math.min(freeWidth(x, top, height, direction, occupied), room, wanted)
      if (!best || width > best.width) best = { x, top, direction, width }
      if (width >= MIN_PART * wanted) break
    }
    const { x, top, direction, width } = best!
    occupied.push({ x: direction > 0 ? x : x - width, y: top, width, height })
    return best!
  })
}

/** The possible places of a label, the best ones first, and the room for it beside its segment. */
function candidates({ x, y, direction, paths }: ValueLabel, height: number) {
  const places: (Omit<PlacedLabel, 'width'> & { room: number })[] = []
  const add = (left: number, top: number, towards: 1 | -1, room = Infinity) =>
    places.push({ x: left, top, direction: towards, room })
  const beside = (left: number, wire: number, towards: 1 | -1, room?: number) => {
    add(left, wire - WIRE_DISTANCE - height, towards, room)
    add(left, wire + WIRE_DISTANCE, towards, room)
  }
  beside(x + END_DISTANCE * direction, y, direction)
  for (const path of paths)
    for (let k = 1; k < path.length; k++) {
      const [[ax, ay], [bx, by]] = [path[k - 1]!, path[k]!]
      if (ay === by) beside(Math.min(ax, bx) + END_DISTANCE, ay, 1, Math.abs(bx - ax) - END_DISTANCE)
      else if (Math.abs(by - ay) > height)
        for (const towards of [1, -1] as const)
          add(ax + WIRE_DISTANCE * towards, (ay + by - height) / 2, towards)
    }
  return places
}

function freeWidth(
  x: number,
  top: number,
  height: number,
  direction: 1 | -1,
  obstacles: readonly Rectangle[],
): number {
  let free = Infinity
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
