import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import type { ViewOf } from '../protocol'
import { shownTime, useCursor } from '../run/cursor'
import { samples } from '../samples'
import { useStudio } from '../store'

const MOST_TRACES = 16
const MOST_POINTS = 4000

/** Every Scope and XY Graph of the run, side by side; all time axes share one cursor and one zoom. */
export function Scopes() {
  const run = useStudio((s) => s.run)
  const views = run?.views.filter(({ kind }) => kind === 'traces' || kind === 'path') ?? []
  if (!run) return <p className="empty">Run the model (Ctrl+Enter) to see its scopes here.</p>
  if (!views.length) return <p className="empty">The model has no Scope and no XY Graph: add one and connect a signal.</p>
  return (
    <div className="scopes">
      {views.map((view) => (
        <Chart key={`${run.run}${view.block}`} view={view} />
      ))}
    </div>
  )
}

interface Trace {
  label: string
  unit: string
  values: () => Float64Array
}

function traces(view: ViewOf): Trace[] {
  return view.signals
    .flatMap((name, k): Trace[] => {
      const path = `${view.block}/${name}`
      const found = samples.signal(path)
      if (!found) return []
      const label = view.labels[k] || found.channel.name
      return found.columns.map((_, i) => ({
        label: found.columns.length > 1 ? `${label} ${i + 1}` : label,
        unit: found.channel.unit,
        values: () => samples.signal(path)?.columns[i] ?? new Float64Array(0),
      }))
    })
    .slice(0, MOST_TRACES)
}

const colour = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()

function Chart({ view }: { view: ViewOf }) {
  const box = useRef<HTMLDivElement>(null)
  const scheme = useComputedColorScheme('light')
  useEffect(() => {
    const element = box.current
    if (!element) return
    const path = view.kind === 'path'
    const shown = traces(view)
    const lines = path ? shown.slice(1, 2) : shown
    const axis = { stroke: colour('muted'), grid: { stroke: colour('grid'), width: 1 }, ticks: { stroke: colour('grid'), width: 1 }, font: '11px Inter Variable' }
    const units = [...new Set(lines.map(({ unit }) => unit))]
    const label = ({ label, unit }: Trace) => (unit ? `${label}, ${unit}` : label)
    const plot = new uPlot(
      {
        width: Math.max(element.clientWidth, 60),
        height: Math.max(element.clientHeight, 60),
        legend: { show: false },
        cursor: path ? { show: false } : { sync: { key: 'time' }, drag: { x: true, y: false } },
        scales: { x: { time: false } },
        axes: [
          { ...axis, size: 34, label: path && shown[0] ? label(shown[0]) : 'time, s', labelSize: 16, labelFont: '11px Inter Variable' },
          { ...axis, size: 52, label: units.length === 1 ? (lines.length === 1 && lines[0] ? label(lines[0]) : units[0] || '') : '', labelSize: 16, labelFont: '11px Inter Variable' },
        ],
        series: [{}, ...lines.map((trace, k) => ({ label: trace.label, stroke: colour(`trace-${k % 8}`), width: 1.5, points: { show: false } }))],
        hooks: { draw: path ? [] : [drawCursor] },
      },
      [[], ...lines.map(() => [])],
      element,
    )
    let seen = -1
    let at = NaN
    let handle = 0
    const frame = () => {
      handle = requestAnimationFrame(frame)
      const now = shownTime()
      if (seen !== samples.version) {
        seen = samples.version
        const time = path ? (shown[0]?.values() ?? new Float64Array(0)) : samples.time.subarray(0, samples.count)
        plot.setData(thinned([time, ...lines.map(({ values }) => values())]))
      } else if (now !== at) plot.redraw(false)
      at = now
    }
    frame()
    const sized = new ResizeObserver(() => plot.setSize({ width: Math.max(element.clientWidth, 60), height: Math.max(element.clientHeight, 60) }))
    sized.observe(element)
    return () => {
      cancelAnimationFrame(handle)
      sized.disconnect()
      plot.destroy()
    }
  }, [view, scheme])
  return (
    <figure className="chart">
      <figcaption>
        <b>{view.title || view.block}</b>
        <span className="legend">
          {traces(view)
            .slice(view.kind === 'path' ? 1 : 0)
            .map(({ label }, k) => (
              <span key={label}>
                <i style={{ background: `var(--trace-${k % 8})` }} />
                {label}
              </span>
            ))}
        </span>
      </figcaption>
      <div ref={box} className="plot" />
    </figure>
  )
}

/** The instant that every view shows, as a line through the chart. */
function drawCursor(plot: uPlot): void {
  if (useCursor.getState().time === null) return
  const x = plot.valToPos(shownTime(), 'x', true)
  const { left, top, width, height } = plot.bbox
  if (x < left || x > left + width) return
  plot.ctx.save()
  plot.ctx.strokeStyle = colour('accent')
  plot.ctx.lineWidth = devicePixelRatio
  plot.ctx.beginPath()
  plot.ctx.moveTo(x, top)
  plot.ctx.lineTo(x, top + height)
  plot.ctx.stroke()
  plot.ctx.restore()
}

/** Few enough points to draw in a frame; of every stretch that is left out, the least and the greatest value stay. */
function thinned(columns: Float64Array[]): uPlot.AlignedData {
  const [time] = columns
  if (!time || time.length <= MOST_POINTS) return columns as unknown as uPlot.AlignedData
  const stretch = Math.ceil((2 * time.length) / MOST_POINTS)
  const kept: number[] = []
  const [, lead] = columns
  for (let from = 0; from < time.length; from += stretch) {
    const to = Math.min(from + stretch, time.length)
    let low = from
    let high = from
    for (let k = from; k < to; k++) {
      if (lead![k]! < lead![low]!) low = k
      if (lead![k]! > lead![high]!) high = k
    }
    kept.push(Math.min(low, high))
    if (low !== high) kept.push(Math.max(low, high))
  }
  if (kept.at(-1) !== time.length - 1) kept.push(time.length - 1)
  return columns.map((column) => Float64Array.from(kept, (k) => column[k]!)) as unknown as uPlot.AlignedData
}
