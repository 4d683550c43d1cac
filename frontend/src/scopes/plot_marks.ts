import type uPlot from 'uplot'
import { shownTime, useCursor } from '../run/cursor'
import { useRuns } from '../run/runs'
import { samples } from '../samples'
import { useWindow } from './window'

export const colour = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()

/** A band about zero: the tolerance of a difference. */
export function drawBand(plot: uPlot, tolerance: number): void {
  const { left, width } = plot.bbox
  const top = plot.valToPos(tolerance, 'y', true)
  const bottom = plot.valToPos(-tolerance, 'y', true)
  plot.ctx.save()
  plot.ctx.fillStyle = colour('sunken')
  plot.ctx.fillRect(left, top, width, bottom - top)
  plot.ctx.restore()
}

/**
 * Vertical lines: the displayed time, the measuring cursors, and the times of parameter changes.
 */
export function drawLines(plot: uPlot): void {
  const { ctx, bbox } = plot
  const { left, top, width, height } = bbox
  const line = (time: number, tone: string, dash: number[], label: string) => {
    const x = plot.valToPos(time, 'x', true)
    if (x < left || x > left + width) return
    ctx.strokeStyle = colour(tone)
    ctx.lineWidth = devicePixelRatio
    ctx.setLineDash(dash.map((part) => part * devicePixelRatio))
    ctx.beginPath()
    ctx.moveTo(x, top)
    ctx.lineTo(x, top + height)
    ctx.stroke()
    if (!label) return
    ctx.font = `${11 * devicePixelRatio}px "Inter Variable", system-ui, sans-serif`
    ctx.fillStyle = colour(tone)
    ctx.textAlign = 'left'
    ctx.fillText(label, x + 3 * devicePixelRatio, top + 10 * devicePixelRatio)
  }
  ctx.save()
  const current = useRuns.getState().runs.find(({ key }) => key === samples.run)
  for (const { time } of current?.tunings ?? []) line(time, 'muted', [2, 3], '')
  const { cursors } = useWindow.getState()
  cursors?.forEach((time, k) => line(time, 'ink', [5, 3], 'AB'[k]!))
  if (useCursor.getState().time !== null) line(shownTime(), 'accent', [], '')
  ctx.restore()
}
