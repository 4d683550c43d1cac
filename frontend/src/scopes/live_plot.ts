import uPlot from 'uplot'
import { changed, watch } from '../frames'
import { Growing } from '../model/growing'
import { sharedDashes } from '../model/identical'
import { extremes, joined, within, type Drawn, type Extremes, type Trace } from '../model/trace'
import { useCursor } from '../run/cursor'
import { mayFollow } from '../run/pace'
import { useRuns } from '../run/runs'
import { samples } from '../samples'
import { useStudio } from '../store'
import { aired, type Figure } from './figure'
import { listen, listenAtValues, type Values } from './plot_gestures'
import { colour } from './plot_marks'
import { LEAST_PX, plotOptions } from './plot_options'
import { reading, useUnits, type Reading } from './quantity'
import { shownWindow, useWindow } from './window'

/** Number of samples per pixel above which only minimum and maximum are drawn. */
const DENSE = 3
/** Margin by which a vertical axis is extended beyond the values during a run, as a fraction of its range. */
const ROOM = 0.15

/** The displayed range in the unit of the signals (`null`: all values), and a callback for changes of it. */
export interface SeenValues {
  values: Values | null
  onValues: (values: Values | null) => void
}

/**
 * A plot that follows a run, drawn in the animation frame after a change. If only samples were added, only
 * these are drawn.
 */
export class LivePlot {
  private readonly plot: uPlot
  private readonly growing: Growing
  private readonly leave: (() => void)[]
  private unit = ''
  private factor = 1
  private drawn: Drawn = [new Float64Array(0)]
  private known: Extremes | undefined
  private dashes: number[][] = []
  private range: [number, number] = [0, 1]
  /** The last examined version of the samples, and the version of the last complete drawing. */
  private seen = 0
  private whole = 0
  /** Other data of the drawing: those that require a complete drawing, and the lines above it. */
  private shape = ''
  private lines = ''

  constructor(
    private readonly element: HTMLElement,
    private readonly shown: Trace[],
    band: number | undefined,
    private readonly held: { readonly current: SeenValues },
  ) {
    this.plot = new uPlot(
      plotOptions(element, shown, () => this.unit, band),
      [[], ...shown.map(() => [])] as uPlot.AlignedData,
      element,
    )
    this.growing = new Growing(
      this.plot,
      shown.map(({ tone, dash }) => ({ colour: colour(tone), dash })),
    )
    const sized = new ResizeObserver(() => {
      this.plot.setSize({
        width: Math.max(element.clientWidth, LEAST_PX),
        height: Math.max(element.clientHeight, LEAST_PX),
      })
      changed()
    })
    this.leave = [
      listen(this.plot),
      listenAtValues(this.plot, (next) =>
        held.current.onValues(next && [next[0] / this.factor, next[1] / this.factor]),
      ),
      watch((at) => this.frame(at)),
      () => sized.disconnect(),
    ]
    sized.observe(element)
  }

  destroy(): void {
    for (const one of this.leave) one()
    this.plot.destroy()
  }

  /** The present picture, for exports. */
  figure(title: string): Figure {
    const { plot, shown } = this
    const [min, max] = [plot.scales['y']?.min ?? 0, plot.scales['y']?.max ?? 1]
    const [from, to] = shownWindow()
    const [x, ...columns] = scaled(this.drawn, this.factor)
    return {
      title,
      width: 760,
      height: 360,
      x: { min: from, max: to, label: 'Time, s' },
      y: { min, max, label: this.unit },
      lines: shown.map(({ tone, dash, label }, k) => ({
        tone,
        dash: this.dashes[k] ?? dash,
        label,
        x,
        y: columns[k] ?? [],
      })),
    }
  }

  private frame(at: number): void {
    if (!this.element.isConnected) return // hidden by another panel
    const [from, to] = shownWindow()
    const width = Math.max(Math.floor(this.plot.bbox.width / devicePixelRatio), 10)
    const live = useStudio.getState().run?.state === 'running'
    const { version, returns, run } = samples
    const shape = [
      run,
      returns,
      from,
      to,
      width,
      this.plot.height,
      live,
      useUnits.getState().radians,
      String(this.held.current.values),
    ].join(' ')
    const marks = [
      useCursor.getState().time,
      String(useWindow.getState().cursors),
      useRuns.getState().runs.at(-1)?.tunings.length,
    ].join(' ')
    const same = shape === this.shape
    const marked = marks === this.lines
    if (same && marked && version === this.seen) return
    if (same && version === this.whole) {
      this.lines = marks
      this.plot.redraw(false, false)
    } else if (same && marked && live && !mayFollow(at)) changed()
    else {
      // During a run samples are only appended; after a step back everything is examined again.
      const before = same ? this.known : undefined
      const made = drawnOf(this.shown, from, to, width, before)
      this.drawn = made.drawn
      this.known = made.extremes
      this.seen = version
      if (this.draw(made, before, live && same, marked, [from, to])) return
      this.whole = version
      this.shape = shape
      this.lines = marks
    }
  }

  /** Draw new samples; returns whether drawing only the new ones was sufficient. */
  private draw(
    made: ToDraw,
    before: Extremes | undefined,
    follows: boolean,
    marked: boolean,
    [from, to]: [number, number],
  ): boolean {
    const { plot, shown, drawn, range } = this
    const found = axisReading(shown, drawn)
    const wanted = this.held.current.values
    const needed: [number, number] = wanted
      ? [wanted[0] * found.factor, wanted[1] * found.factor]
      : rangeOf(drawn, found.factor, from, to)
    const alike = found.factor === this.factor
    const fits = follows && needed[0] >= range[0] && needed[1] <= range[1]
    if (fits && marked && alike && Boolean(made.extremes) === Boolean(before) && made.ends) {
      this.growing.grow(drawn, this.factor, made.ends, devicePixelRatio)
      return true
    }
    this.range = fits ? range : follows && alike ? withRoom(needed, range) : needed
    this.factor = found.factor
    this.unit = shown.length === 1 ? [shown[0]!.label, found.unit].filter(Boolean).join(', ') : found.unit
    const dashes = sharedDashes(drawn, (this.range[1] - this.range[0]) / this.factor)
    this.dashes = shown.map(({ dash }, k) => dashes[k] ?? dash)
    this.dashes.forEach((dash, k) => {
      plot.series[k + 1]!.dash = dash
    })
    this.growing.dashed(this.dashes)
    plot.batch(() => {
      plot.setData(scaled(drawn, this.factor), false)
      plot.setScale('x', { min: from, max: to })
      plot.setScale('y', { min: this.range[0], max: this.range[1] })
    })
    if (made.ends) this.growing.shows(drawn, made.ends)
    return false
  }
}

/** Unit and factor of the vertical axis if all traces have the same unit. */
function axisReading(traces: Trace[], drawn: Drawn): Reading {
  const [first, ...others] = traces
  if (!first || others.some(({ unit }) => unit !== first.unit)) return { factor: 1, unit: '' }
  let largest = 0
  for (const column of drawn.slice(1))
    for (const value of column)
      if (typeof value === 'number' && Math.abs(value) > largest) largest = Math.abs(value)
  return reading(first.unit, largest)
}

/** The data to draw; the rows of each trace before its end do not change during the run. */
interface ToDraw {
  drawn: Drawn
  ends?: number[]
  extremes?: Extremes
}

/** The data to draw in a window: samples if there are few, otherwise the extremes in each pixel. */
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
  return { drawn: joined(parts) }
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

/** Minimum and maximum of the visible values, with a margin. */
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

/** Extend a range that is too small, with a margin in the direction of growth: each change redraws all. */
function withRoom([low, high]: [number, number], [before, after]: [number, number]): [number, number] {
  const room = ROOM * (Math.max(high, after) - Math.min(low, before))
  return [low < before ? low - room : before, high > after ? high + room : after]
}
