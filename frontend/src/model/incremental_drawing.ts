import type { PlotColumns } from './trace'

/** Line style of a trace: colour for the canvas, and dashes, px. */
export interface Stroke {
  colour: string
  dash: number[]
}

/**
 * A plot that is already drawn: its canvas, the area of the lines on it, and the mapping from values to
 * device px.
 */
export interface DrawnPlot {
  ctx: CanvasRenderingContext2D
  bbox: { left: number; top: number; width: number; height: number }
  valToPos: (value: number, scale: string, onCanvas: boolean) => number
}

/** Line width, CSS px. */
const WIDTH = 1.5

/**
 * Draws the new samples of a run onto an existing plot, which is not redrawn. The
 * lines equal those of uPlot, which redraws the whole plot when anything else changes.
 */
export class IncrementalDrawing {
  /** For each trace the last drawn row, and the phase of its dashes (px). */
  private lastRows: number[] = []
  private dashOffsets: number[] = []

  constructor(
    private readonly plot: DrawnPlot,
    private strokes: readonly Stroke[],
  ) {}

  /** Change the dashes of the traces, before a complete redraw. */
  setDashes(dashes: readonly number[][]): void {
    this.strokes = this.strokes.map((stroke, k) => ({ ...stroke, dash: dashes[k] ?? stroke.dash }))
  }

  /** Set the state after a complete redraw. */
  reset([, ...columns]: PlotColumns, ends: number[]): void {
    this.lastRows = columns.map((column, k) => lastBefore(column, ends[k]!))
    this.dashOffsets = columns.map(() => 0)
  }

  /**
   * Draw the new rows; from the rows `ends` on, values may still change. `factor` converts the values to the
   * displayed unit, and `ratio` is device px per CSS px.
   */
  append([time, ...columns]: PlotColumns, factor: number, ends: number[], ratio: number): void {
    const { ctx, bbox } = this.plot
    ctx.save()
    ctx.beginPath()
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height)
    ctx.clip()
    ctx.lineWidth = WIDTH * ratio
    ctx.lineJoin = 'round'
    columns.forEach((column, k) => {
      const from = this.lastRows[k]!
      const to = lastBefore(column, ends[k]!)
      if (to <= from) return
      this.lastRows[k] = to
      const { colour, dash } = this.strokes[k]!
      ctx.strokeStyle = colour
      ctx.setLineDash(dash)
      ctx.lineDashOffset = this.dashOffsets[k]!
      ctx.beginPath()
      let [lastX, lastY] = [NaN, NaN]
      for (let row = Math.max(from, 0); row <= to; row++) {
        const value = column[row]
        if (typeof value !== 'number' || Number.isNaN(value)) continue
        const x = this.plot.valToPos(time[row]!, 'x', true)
        const y = this.plot.valToPos(value * factor, 'y', true)
        if (Number.isNaN(lastX)) ctx.moveTo(x, y)
        else {
          ctx.lineTo(x, y)
          if (dash.length) this.dashOffsets[k]! += Math.hypot(x - lastX, y - lastY)
        }
        lastX = x
        lastY = y
      }
      ctx.stroke()
    })
    ctx.restore()
  }
}

/** The last row before `end` with a value; -1 if there is none. */
function lastBefore(column: PlotColumns[number], end: number): number {
  let row = Math.min(end, column.length) - 1
  while (row >= 0 && typeof column[row] !== 'number') row--
  return row
}
