/** Columns and rows of the scopes in their panel. */
export interface ScopeGrid {
  columns: number
  /** Height of a row, px. Rows that do not fit into the panel are reached by scrolling. */
  rowHeight: number
}

/** Preferred ratio of the width to the height of a chart. */
const ASPECT_RATIO = 1.7
/** Smallest size of a chart, px. */
const MIN_WIDTH = 220
const MIN_HEIGHT = 150
/** Height of the visible part of a row that is reached by scrolling: its titles, px. */
const NEXT_ROW_HEIGHT = 26

/** The grid with the largest charts that fills a panel; `minWidth` is larger with tables of measures. */
export function scopeGrid(
  count: number,
  width: number,
  height: number,
  minWidth: number = MIN_WIDTH,
): ScopeGrid {
  const maxColumns = Math.max(1, Math.min(count, Math.floor(width / minWidth)))
  let best: ScopeGrid | null = null
  let bestSize = 0
  for (let columns = 1; columns <= maxColumns; columns++) {
    const rowHeight = height / Math.ceil(count / columns)
    if (rowHeight < MIN_HEIGHT) continue
    const chartSize = Math.min(width / columns / ASPECT_RATIO, rowHeight)
    if (chartSize > bestSize + 1e-9) {
      best = { columns, rowHeight }
      bestSize = chartSize
    }
  }
  if (best) return best
  const [rows, available] = [Math.ceil(count / maxColumns), Math.max(height - NEXT_ROW_HEIGHT, 0)]
  const visibleRows = Math.max(1, Math.floor(available / MIN_HEIGHT))
  return { columns: maxColumns, rowHeight: visibleRows < rows ? available / visibleRows : height / rows }
}
