import type { PlotColumns } from './trace'

/** Length of one dash of a shared line, px. */
const DASH_PX = 7
/** Distance below which two traces are drawn on the same pixels, as a fraction of the vertical range. */
const SAME_LINE = 1 / 2000

/**
 * The dashes of traces that coincide: the traces alternate along the line, so that each is visible.
 * `null` for a trace that coincides with no other. `range`: of the vertical axis, in the unit of the values.
 */
export function sharedDashes([, ...columns]: PlotColumns, range: number): (number[] | null)[] {
  const groups: number[][] = []
  columns.forEach((column, k) => {
    const group = groups.find(([first]) => isSameLine(columns[first!]!, column, SAME_LINE * range))
    if (group) group.push(k)
    else groups.push([k])
  })
  const dashes: (number[] | null)[] = columns.map(() => null)
  for (const group of groups)
    if (group.length > 1)
      group.forEach((column, order) => {
        dashes[column] = dashOf(order, group.length)
      })
  return dashes
}

/** The dash pattern of one of several lines that alternate. */
function dashOf(order: number, count: number): number[] {
  return order === 0
    ? [DASH_PX, (count - 1) * DASH_PX]
    : [0, order * DASH_PX, DASH_PX, (count - 1 - order) * DASH_PX]
}

type Column = PlotColumns[number]

function isSameLine(first: Column, other: Column, tolerance: number): boolean {
  if (first.length !== other.length) return false
  let hasValues = false
  for (let k = 0; k < first.length; k++) {
    const [a, b] = [first[k], other[k]]
    if (typeof a !== 'number' || typeof b !== 'number') {
      if (typeof a !== typeof b) return false
      continue
    }
    if (!(Math.abs(a - b) <= tolerance)) return false
    hasValues = true
  }
  return hasValues
}
