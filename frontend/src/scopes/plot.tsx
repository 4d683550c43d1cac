import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import { changed, watch } from '../frames'
import { shownTime, useCursor } from '../run/cursor'
import { mayFollow } from '../run/pace'
import { useRuns } from '../run/runs'
import { samples } from '../samples'
import { useStudio } from '../store'
import { aired, type Figure } from './figure'
import { Growing } from '../model/growing'
import { digits, reading, useUnits, type Reading } from './quantity'
import { extremes, within, type Drawn, type Extremes, type Trace } from '../model/trace'
import { pan, shownWindow, useWindow, zoomBy, zoomTo } from './window'

const FONT = '11px "Inter Variable", system-ui, sans-serif'
const GRIP_PX = 6
const CLICK_PX = 3
/** From so many samples in a pixel on only the least and the greatest are drawn. */
const DENSE = 3
/** While a run goes on, the part of its range that a vertical axis grows by beyond what is needed. */
const ROOM = 0.15
const colour = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()

/** What a plot shows now, for those beside it: measures and exports. */
export interface PlotHandle {
  figure: () => Figure
}

interface Props {
  traces: Trace[]
  hidden: ReadonlySet<string>
  title: string
  handle?: React.RefObject<PlotHandle | null>
  /** A band about zero: the tolerance of a difference. */
  band?: number
  /** The values that are seen, in the unit of the signals; `null` is all of them. */
  values: Values | null
  onValues: (values: Values | null) => void
}

export type Values = [low: number, high: number]

/** Unit and factor of the vertical axis: shared by all traces, or none. */
function axisReading(traces: Trace[], drawn: Drawn): Reading {
  const [first, ...others] = traces
  if (!first || others.some(({ unit }) => unit !== first.unit)) return { factor: 1, unit: '' }
  let largest = 0
  for (const column of drawn.slice(1))
    for (const value of column)
      if (typeof value === 'number' && Math.abs(value) > largest) largest = Math.abs(value)
  return reading(first.unit, largest)
}

/** What there is to draw; of each trace the rows before its end stay as they are while the run goes on. */
interface ToDraw {
  drawn: Drawn
  ends?: number[]
  extremes?: Extremes
}

/** What there is to draw in a window: raw samples while few, else the extremes of each pixel. */
function drawnOf(
  traces: Trace[],
  from: number,
  to: number,
  width: number,
  before: Extremes | undefined,
): ToDraw {
  const found = traces.map(({ read }) => read() ?? { time: new Float64Array(0), values: new Float64Array(0) })
  const parts = found.map((one) => within(one, from, to))
  if (parts.some(({ time }) => time.length > DENSE * width)) {
    const known = extremes(found, from, to, width, before)
    return { drawn: known.drawn, ends: known.ends, extremes: known }
  }
  const [first, ...others] = parts
  if (!first) return { drawn: [new Float64Array(0)] }
  if (
    others.every(
      ({ time }) =>
        time.buffer === first.time.buffer &&
        time.length === first.time.length &&
        time.byteOffset === first.time.byteOffset,
    )
  )
    return {
      drawn: [first.time, ...parts.map(({ values }) => values)],
      ends: parts.map(({ time }) => time.length),
    }
  return {
    drawn: uPlot.join(
      parts.map(({ time, values }) => [time, values] as uPlot.AlignedData),
    ) as unknown as Drawn,
  }
}

function scaled(drawn: Drawn, factor: number): Drawn {
  if (factor === 1) return drawn
  const [time, ...columns] = drawn
  return [
    time,
    ...columns.map((column) =>
      column instanceof Float64Array
        ? column.map((v) => v * factor)
        : column.map((v) => (typeof v === 'number' ? v * factor : v)),
    ),
  ]
}

/** Traces over time. All such plots share zoom, measuring cursors and the instant that is shown. */
export function Plot({ traces, hidden, title, handle, band, values, onValues }: Props) {
  const box = useRef<HTMLDivElement>(null)
  const held = useRef({ values, onValues })
  held.current = { values, onValues }
  const scheme = useComputedColorScheme('light')
  const shown = traces.filter(({ key }) => !hidden.has(key))
  const identity = shown.map(({ key, tone, dash }) => `${key} ${tone} ${dash.join()}`).join('\n')
  useEffect(() => {
    const element = box.current
    if (!element) return
    let unit = ''
    let factor = 1
    let drawn: Drawn = [new Float64Array(0)]
    const axis = {
      stroke: colour('muted'),
      grid: { stroke: colour('grid'), width: 1 },
      ticks: { stroke: colour('grid'), width: 1 },
      font: FONT,
      labelFont: FONT,
      labelSize: 16,
      labelGap: 0,
    }
    const plot = new uPlot(
      {
        width: Math.max(element.clientWidth, 60),
        height: Math.max(element.clientHeight, 60),
        legend: { show: false },
        cursor: {
          points: { show: false },
          drag: { x: true, y: false, setScale: false },
          bind: {
            dblclick: () => () => (useWindow.setState({ range: null }), null),
            mousedown: (u, _, handler) => (event) =>
              gripOf(u, event) !== null || event.button || event.shiftKey ? null : handler(event),
          },
        },
        scales: { x: { time: false, auto: false }, y: { auto: false } },
        axes: [
          {
            ...axis,
            size: 32,
            label: 'time, s',
            values: (_, splits) => splits.map((value) => tick(value, splits)),
          },
          {
            ...axis,
            size: 54,
            label: () => unit,
            values: (_, splits) => splits.map((value) => tick(value, splits)),
          },
        ],
        series: [
          {},
          ...shown.map(({ label, tone, dash }) => ({
            label,
            stroke: colour(tone),
            width: 1.5,
            dash,
            spanGaps: true,
            points: { show: false },
          })),
        ],
        hooks: {
          drawClear: [(u) => band !== undefined && drawBand(u, band)],
          draw: [(u) => drawLines(u)],
          setSelect: [
            (u) => {
              if (u.select.width < CLICK_PX) return
              zoomTo(u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x'))
              u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false)
            },
          ],
        },
      },
      [[], ...shown.map(() => [])] as uPlot.AlignedData,
      element,
    )
    const leave = [
      listen(plot),
      listenAtValues(plot, (next) => held.current.onValues(next && [next[0] / factor, next[1] / factor])),
    ]
    const growing = new Growing(
      plot,
      shown.map(({ tone, dash }) => ({ colour: colour(tone), dash })),
    )
    let known: Extremes | undefined
    let range: [number, number] = [0, 1]
    let seen = 0
    let whole = 0
    let shape = ''
    let lines = ''
    const frame = (at: number) => {
      if (!element.isConnected) return // behind another panel
      const [from, to] = shownWindow()
      const width = Math.max(Math.floor(plot.bbox.width / devicePixelRatio), 10)
      const live = useStudio.getState().run?.state === 'running'
      const { version, returns, run } = samples
      const now = `${run} ${returns} ${from} ${to} ${width} ${plot.height} ${live} ${useUnits.getState().radians} ${String(held.current.values)}`
      const marks = `${useCursor.getState().time} ${String(useWindow.getState().cursors)} ${useRuns.getState().runs.at(-1)?.tunings.length}`
      const same = now === shape
      if (same && marks === lines && version === seen) return
      if (same && version === whole) {
        lines = marks
        plot.redraw(false, false)
        return
      }
      if (same && marks === lines && live && !mayFollow(at)) {
        changed()
        return
      }
      // What is drawn of a run that goes on only grows; once it went back, all is looked at again.
      const before = same ? known : undefined
      const made = drawnOf(shown, from, to, width, before)
      drawn = made.drawn
      known = made.extremes
      seen = version
      const found = axisReading(shown, drawn)
      const wanted = held.current.values
      const needed: [number, number] = wanted
        ? [wanted[0] * found.factor, wanted[1] * found.factor]
        : rangeOf(drawn, found.factor, from, to)
      const fits = live && same && needed[0] >= range[0] && needed[1] <= range[1]
      const grown =
        fits && marks === lines && found.factor === factor && Boolean(made.extremes) === Boolean(before)
      if (grown && made.ends) {
        growing.grow(drawn, factor, made.ends, devicePixelRatio)
        return
      }
      range = fits ? range : live && same && found.factor === factor ? withRoom(needed, range) : needed
      factor = found.factor
      whole = version
      shape = now
      lines = marks
      unit = shown.length === 1 ? [shown[0]!.label, found.unit].filter(Boolean).join(', ') : found.unit
      plot.batch(() => {
        plot.setData(scaled(drawn, factor), false)
        plot.setScale('x', { min: from, max: to })
        plot.setScale('y', { min: range[0], max: range[1] })
      })
      if (made.ends) growing.shows(drawn, made.ends)
    }
    leave.push(watch(frame))
    if (handle)
      handle.current = {
        figure: () => {
          const [min, max] = [plot.scales['y']?.min ?? 0, plot.scales['y']?.max ?? 1]
          const [from, to] = shownWindow()
          const [x, ...columns] = scaled(drawn, factor)
          return {
            title,
            width: 760,
            height: 360,
            x: { min: from, max: to, label: 'time, s' },
            y: { min, max, label: unit },
            lines: shown.map(({ tone, dash, label }, k) => ({ tone, dash, label, x, y: columns[k] ?? [] })),
          }
        },
      }
    const sized = new ResizeObserver(() => {
      plot.setSize({ width: Math.max(element.clientWidth, 60), height: Math.max(element.clientHeight, 60) })
      changed()
    })
    sized.observe(element)
    return () => {
      sized.disconnect()
      for (const one of leave) one()
      plot.destroy()
    }
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [identity, scheme, title, band])
  useEffect(changed, [values])
  return (
    <div
      ref={box}
      className="plot"
      role="img"
      aria-label={`${title}: ${shown.map(({ label }) => label).join(', ')}`}
    />
  )
}

function tick(value: number, splits: number[]): string {
  const step = Math.abs((splits[1] ?? 1) - (splits[0] ?? 0))
  if (Math.abs(value) >= 1e6 || step < 1e-6) return digits(value, 3)
  return value.toFixed((String(Number(step.toPrecision(3))).split('.')[1] ?? '').length).replace('-', '−')
}

/** Least and greatest value that is seen, with air around them. */
function rangeOf([time, ...columns]: Drawn, factor: number, from: number, to: number): [number, number] {
  let low = Infinity
  let high = -Infinity
  for (const column of columns)
    for (let k = 0; k < time.length; k++) {
      const value = column[k]
      if (typeof value !== 'number' || !(time[k]! >= from && time[k]! <= to)) continue
      if (value < low) low = value
      if (value > high) high = value
    }
  return aired(low * factor, high * factor)
}

/** A range that has become too small, with room to where it grows: each change of it draws all anew. */
function withRoom([low, high]: [number, number], [before, after]: [number, number]): [number, number] {
  const room = ROOM * (Math.max(high, after) - Math.min(low, before))
  return [low < before ? low - room : before, high > after ? high + room : after]
}

/** Which measuring cursor is under the pointer. */
function gripOf(plot: uPlot, event: MouseEvent): 0 | 1 | null {
  const { cursors } = useWindow.getState()
  if (!cursors) return null
  const x = event.clientX - plot.over.getBoundingClientRect().left
  const far = cursors.map((time) => Math.abs(plot.valToPos(time, 'x') - x))
  const nearest = far[0]! <= far[1]! ? 0 : 1
  return far[nearest]! <= GRIP_PX ? nearest : null
}

/** Wheel zooms, Shift or the middle button pans, a click shows an instant, measuring cursors are dragged. */
function listen(plot: uPlot): () => void {
  const { over } = plot
  const timeOf = (event: MouseEvent) => plot.posToVal(event.clientX - over.getBoundingClientRect().left, 'x')
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const [from, to] = shownWindow()
    if (event.shiftKey || event.deltaX) pan(((to - from) * (event.deltaX || event.deltaY)) / over.clientWidth)
    else zoomBy(event.deltaY > 0 ? 1.25 : 0.8, timeOf(event))
  }
  const down = (event: PointerEvent) => {
    const grip = gripOf(plot, event)
    const panning = event.button === 1 || event.shiftKey
    const from = event.clientX
    let last = event.clientX
    const move = (moved: PointerEvent) => {
      const { cursors } = useWindow.getState()
      if (grip !== null && cursors) {
        const [first, end] = shownWindow()
        const time = Math.min(Math.max(timeOf(moved), first), end)
        useWindow.setState({ cursors: grip ? [cursors[0], time] : [time, cursors[1]] })
      } else if (panning) {
        const [first, end] = shownWindow()
        pan(((end - first) * (last - moved.clientX)) / over.clientWidth)
        last = moved.clientX
      }
    }
    const up = (ended: PointerEvent) => {
      removeEventListener('pointermove', move)
      removeEventListener('pointerup', up)
      if (grip === null && !panning && Math.abs(ended.clientX - from) < CLICK_PX)
        useCursor.setState({ time: Math.max(timeOf(ended), 0), playing: false })
    }
    if (panning || grip !== null) event.preventDefault()
    addEventListener('pointermove', move)
    addEventListener('pointerup', up)
  }
  const hover = (event: PointerEvent) => {
    over.style.cursor = gripOf(plot, event) === null ? '' : 'ew-resize'
  }
  over.addEventListener('wheel', wheel, { passive: false })
  over.addEventListener('pointerdown', down)
  over.addEventListener('pointermove', hover)
  return () => {
    over.removeEventListener('wheel', wheel)
    over.removeEventListener('pointerdown', down)
    over.removeEventListener('pointermove', hover)
  }
}

const ZOOM = 1.25

/** On the axis of values the wheel zooms about the pointer, dragging moves, and a double click shows all values. */
function listenAtValues(plot: uPlot, show: (values: Values | null) => void): () => void {
  const axis = plot.root.querySelectorAll<HTMLElement>('.u-axis')[1]
  if (!axis) return () => {}
  axis.classList.add('values-axis')
  axis.title = 'Wheel: zoom the values. Drag: move them. Double click: show all.'
  const seen = (): Values => [plot.scales['y']?.min ?? 0, plot.scales['y']?.max ?? 1]
  const valueOf = (event: MouseEvent) =>
    plot.posToVal(event.clientY - plot.over.getBoundingClientRect().top, 'y')
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const by = event.deltaY > 0 ? ZOOM : 1 / ZOOM
    const about = valueOf(event)
    show(seen().map((end) => about + by * (end - about)) as Values)
  }
  const down = (event: PointerEvent) => {
    if (event.button !== 0) return
    const begun = seen()
    const start = event.clientY
    axis.setPointerCapture(event.pointerId)
    const move = (moved: PointerEvent) => {
      const by = ((moved.clientY - start) / plot.over.clientHeight) * (begun[1] - begun[0])
      if (Math.abs(moved.clientY - start) >= CLICK_PX) show([begun[0] + by, begun[1] + by])
    }
    const up = () => {
      axis.removeEventListener('pointermove', move)
      axis.removeEventListener('pointerup', up)
    }
    axis.addEventListener('pointermove', move)
    axis.addEventListener('pointerup', up)
  }
  const all = () => show(null)
  axis.addEventListener('wheel', wheel, { passive: false })
  axis.addEventListener('pointerdown', down)
  axis.addEventListener('dblclick', all)
  return () => {
    axis.removeEventListener('wheel', wheel)
    axis.removeEventListener('pointerdown', down)
    axis.removeEventListener('dblclick', all)
  }
}

function drawBand(plot: uPlot, tolerance: number): void {
  const { left, width } = plot.bbox
  const top = plot.valToPos(tolerance, 'y', true)
  const bottom = plot.valToPos(-tolerance, 'y', true)
  plot.ctx.save()
  plot.ctx.fillStyle = colour('sunken')
  plot.ctx.fillRect(left, top, width, bottom - top)
  plot.ctx.restore()
}

/** Upright lines: the instant that every view shows, the measuring cursors, and where a parameter was tuned. */
function drawLines(plot: uPlot): void {
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
