/** Positions of new blocks that are added by name. */

export interface Rectangle {
  x: number
  y: number
  width: number
  height: number
}

/** Distance of a new block from the other blocks, with room for names and port labels, px. */
const CLEARANCE = { x: 30, y: 25 }
const STEP = 20

const overlap = (a: Rectangle, b: Rectangle): boolean =>
  a.x < b.x + b.width + CLEARANCE.x &&
  b.x < a.x + a.width + CLEARANCE.x &&
  a.y < b.y + b.height + CLEARANCE.y &&
  b.y < a.y + a.height + CLEARANCE.y

const isFree = (place: Rectangle, blocks: readonly Rectangle[]): boolean =>
  !blocks.some((block) => overlap(place, block))

/** The first free place for a block at or below a position. */
export function freeBelow(preferred: Rectangle, blocks: readonly Rectangle[]): Rectangle {
  let free = preferred
  while (!isFree(free, blocks)) free = { ...free, y: free.y + STEP }
  return free
}

/**
 * The free place for a block of a size that is nearest to the middle of the visible part; below all blocks if
 * no place in the visible part is free.
 */
export function freeInView(
  size: { width: number; height: number },
  view: Rectangle,
  blocks: readonly Rectangle[],
): Rectangle {
  const [x, y] = [view.x + (view.width - size.width) / 2, view.y + (view.height - size.height) / 2]
  const [columns, rows] = [
    Math.floor(Math.max(x - view.x, 0) / STEP),
    Math.floor(Math.max(y - view.y, 0) / STEP),
  ]
  const nearBlocks = blocks.filter((block) => overlap(view, block))
  let nearest: Rectangle | null = null
  let shortest = Infinity
  for (let row = -rows; row <= rows; row++)
    for (let column = -columns; column <= columns; column++) {
      const distance = row * row + column * column
      if (distance >= shortest) continue
      const place = { ...size, x: x + STEP * column, y: y + STEP * row }
      if (!isFree(place, nearBlocks)) continue
      nearest = place
      shortest = distance
    }
  return (
    nearest ?? {
      ...size,
      x: Math.min(...blocks.map((block) => block.x)),
      y: Math.max(...blocks.map((block) => block.y + block.height)) + 2 * CLEARANCE.y,
    }
  )
}

interface Spot {
  x?: number
  y?: number
}

/** The smallest multiple of a shift, px, after which no copy is exactly at the place of another object. */
export function freeShift(copies: readonly Spot[], places: readonly Spot[], step: number): number {
  const taken = new Set(places.map(({ x, y }) => `${x} ${y}`))
  const collides = (shift: number) =>
    copies.some(({ x, y }) => x !== undefined && y !== undefined && taken.has(`${x + shift} ${y + shift}`))
  let shift = step
  while (collides(shift)) shift += step
  return shift
}

/** The size that is assumed for blocks whose size is not known, px. */
const USUAL_SIZE = { width: 70, height: 50 }

/**
 * The shift, a multiple of `grid`, that brings copies to a free place in the visible part; `null` if one of
 * them is visible without a shift.
 */
export function shiftIntoView(
  copies: readonly Spot[],
  view: Rectangle,
  blocks: readonly Rectangle[],
  grid: number,
): [number, number] | null {
  const spots = copies.filter((copy): copy is { x: number; y: number } => (copy.x ?? copy.y) !== undefined)
  const isVisible = ({ x, y }: { x: number; y: number }) =>
    x + USUAL_SIZE.width > view.x &&
    x < view.x + view.width &&
    y + USUAL_SIZE.height > view.y &&
    y < view.y + view.height
  if (!spots.length || spots.some(isVisible)) return null
  const [xs, ys] = [spots.map(({ x }) => x), spots.map(({ y }) => y)]
  const [left, top] = [Math.min(...xs), Math.min(...ys)]
  const size = {
    width: Math.max(...xs) - left + USUAL_SIZE.width,
    height: Math.max(...ys) - top + USUAL_SIZE.height,
  }
  const place = freeInView(size, view, blocks)
  const onGrid = (distance: number) => grid * Math.round(distance / grid)
  return [onGrid(place.x - left), onGrid(place.y - top)]
}
