import type uPlot from 'uplot'
import { shownTime, useCursor } from '../run/cursor'
import { useRuns } from '../run/runs'
import { samples } from '../samples'
import type { Trace } from '../model/trace'
import { useTrigger } from './trigger'
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

/** The level of the trigger, in the plots that show its signal. */
function drawLevel(plot: uPlot, traces: Trace[], unitFactor: number): void {
  const { on, level, channel, element } = useTrigger.getState()
  if (!on || !traces.some((trace) => trace.channel === channel && trace.element === element)) return
  const { ctx, bbox } = plot
  const y = plot.valToPos(level * unitFactor, 'y', true)
  if (y < bbox.top || y > bbox.top + bbox.height) return
  ctx.strokeStyle = colour('muted')
  ctx.lineWidth = devicePixelRatio
  ctx.setLineDash([3, 3].map((part) => part * devicePixelRatio))
  ctx.beginPath()
  ctx.moveTo(bbox.left, y)
  ctx.lineTo(bbox.left + bbox.width, y)
  ctx.stroke()
}

/**
 * Vertical lines: the displayed time, the measuring cursors, the trigger with its level, and the times of
 * parameter changes.
 */
export function drawLines(plot: uPlot, traces: Trace[], unitFactor: number): void {
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
    const gap = 3 * devicePixelRatio
    const fits = x + gap + ctx.measureText(label).width <= left + width
    ctx.textAlign = fits ? 'left' : 'right'
    ctx.fillText(label, fits ? x + gap : x - gap, top + 10 * devicePixelRatio)
  }
  ctx.save()
  const current = useRuns.getState().runs.find(({ key }) => key === samples.run)
  for (const { time } of current?.tunings ?? []) line(time, 'muted', [2, 3], '')
  const { on, at } = useTrigger.getState()
  if (on && at !== null) line(at, 'muted', [1, 3], 'T')
  drawLevel(plot, traces, unitFactor)
  const { cursors } = useWindow.getState()
  cursors?.forEach((time, k) => line(time, 'ink', [5, 3], 'AB'[k]!))
  if (useCursor.getState().time !== null) line(shownTime(), 'accent', [], '')
  ctx.restore()
}
