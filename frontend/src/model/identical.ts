import type { Drawn } from './trace'

/** Length of one dash of a shared line, px. */
const DASH = 7
/** Distance below which two traces are drawn on the same pixels, as a fraction of the vertical range. */
const SAME = 1 / 2000

/**
 * The dashes of traces that lie on each other: they take turns along the line, so that each is visible.
 * `null` for a trace that lies on no other. `range`: of the vertical axis, in the unit of the values.
 */
export function sharedDashes([, ...columns]: Drawn, range: number): (number[] | null)[] {
  const groups: number[][] = []
  columns.forEach((column, k) => {
    const group = groups.find(([first]) => isSame(columns[first!]!, column, SAME * range))
    if (group) group.push(k)
    else groups.push([k])
  })
  const dashes: (number[] | null)[] = columns.map(() => null)
  for (const group of groups)
    if (group.length > 1)
      group.forEach((column, turn) => {
        dashes[column] = turnDash(turn, group.length)
      })
  return dashes
}

/** The dash pattern of one of several lines that take turns. */
function turnDash(turn: number, of: number): number[] {
  return turn === 0 ? [DASH, (of - 1) * DASH] : [0, turn * DASH, DASH, (of - 1 - turn) * DASH]
}

type Column = Drawn[number]

function isSame(one: Column, other: Column, tolerance: number): boolean {
  if (one.length !== other.length) return false
  let drawn = false
  for (let k = 0; k < one.length; k++) {
    const [a, b] = [one[k], other[k]]
    if (typeof a !== 'number' || typeof b !== 'number') {
      if (typeof a !== typeof b) return false
      continue
    }
    if (!(Math.abs(a - b) <= tolerance)) return false
    drawn = true
  }
  return drawn
}
