/** Columns and rows of the scopes in their panel. */
export interface ScopeGrid {
  columns: number
  /** Height of a row, px. Rows that do not fit into the panel are reached by scrolling. */
  rowHeight: number
}

/** Ratio of width to height at which a chart is read best. */
const SHAPE = 1.7
/** Smallest size of a chart, px. */
const LEAST_WIDTH = 220
const LEAST_HEIGHT = 150
/** Height of the visible part of a row that is reached by scrolling: its titles, px. */
const NEXT_ROW = 26

/** The grid with the largest charts that fills a panel; `leastWidth` is larger with tables of measures. */
export function scopeGrid(
  count: number,
  width: number,
  height: number,
  leastWidth: number = LEAST_WIDTH,
): ScopeGrid {
  const most = Math.max(1, Math.min(count, Math.floor(width / leastWidth)))
  let best: ScopeGrid | null = null
  let size = 0
  for (let columns = 1; columns <= most; columns++) {
    const rowHeight = height / Math.ceil(count / columns)
    if (rowHeight < LEAST_HEIGHT) continue
    const reached = Math.min(width / columns / SHAPE, rowHeight)
    if (reached > size + 1e-9) {
      best = { columns, rowHeight }
      size = reached
    }
  }
  if (best) return best
  const [rows, room] = [Math.ceil(count / most), Math.max(height - NEXT_ROW, 0)]
  const visible = Math.max(1, Math.floor(room / LEAST_HEIGHT))
  return { columns: most, rowHeight: visible < rows ? room / visible : height / rows }
}
