import uPlot from 'uplot'
import { scheduleFrame, onFrame } from '../frames'
import { withGrowthMargin, withMargin } from '../model/axis_range'
import { fittedLabel } from '../model/axis_texts'
import { IncrementalDrawing } from '../model/incremental_drawing'
import { sharedDashes } from '../model/shared_lines'
import {
  extremes,
  withCommonTimes,
  samplesBetween,
  type PlotColumns,
  type Extremes,
  type Trace,
} from '../model/trace'
import { useCursor } from '../run/cursor'
import { mayDraw } from '../run/pace'
import { useRuns } from '../run/runs'
import { samples } from '../samples'
import { useStudio } from '../store'
import type { Figure } from './figure'
import { listenOnPlot, listenOnValueAxis, type Values } from './plot_gestures'
import { colour } from './plot_marks'
import { MIN_PX, plotOptions, TIME_AXIS_HEIGHT } from './plot_options'
import { displayUnit, useUnits, type DisplayUnit } from './quantity'
import { useTrigger } from './trigger'
import { visibleTimes, useWindow } from './window'

/** Number of samples per pixel above which only minimum and maximum are drawn. */
const DENSE_SAMPLES = 3

/** The displayed range in the unit of the signals (`null`: all values), and a callback for changes of it. */
export interface ValueRange {
  values: Values | null
  onValues: (values: Values | null) => void
}

/**
 * A plot that follows a run, drawn in the animation frame after a change. If only samples were added, only
 * these are drawn.
 */
export class LivePlot {
  private readonly plot: uPlot
  private readonly drawing: IncrementalDrawing
  private readonly unsubscribers: (() => void)[]
  private unit = ''
  private unitFactor = 1
  private columns: PlotColumns = [new Float64Array(0)]
  private extremes: Extremes | undefined
  private dashes: number[][] = []
  private range: [number, number] = [0, 1]
  /** The last examined version of the samples, and the version of the last complete drawing. */
  private examinedVersion = 0
  private drawnVersion = 0
  /** Other drawn data: a new `shapeKey` requires a complete drawing, a new `lineKey` only new lines. */
  private shapeKey = ''
  private lineKey = ''

  constructor(
    private readonly element: HTMLElement,
    private readonly traces: Trace[],
    band: number | undefined,
    private readonly valueRange: { readonly current: ValueRange },
    /** Traces of another plot whose value axis is to be the same. */
    private readonly companions: Trace[] = [],
  ) {
    this.plot = new uPlot(
      plotOptions(
        element,
        traces,
        () => fittedLabel(this.unit, this.plot.height - TIME_AXIS_HEIGHT),
        () => this.unitFactor,
        band,
      ),
      [[], ...traces.map(() => [])] as uPlot.AlignedData,
      element,
    )
    this.drawing = new IncrementalDrawing(
      this.plot,
      traces.map(({ tone, dash }) => ({ colour: colour(tone), dash })),
    )
    const observer = new ResizeObserver(() => {
      this.plot.setSize({
        width: Math.max(element.clientWidth, MIN_PX),
        height: Math.max(element.clientHeight, MIN_PX),
      })
      scheduleFrame()
    })
    this.unsubscribers = [
      listenOnPlot(this.plot),
      listenOnValueAxis(this.plot, (next) =>
        valueRange.current.onValues(next && [next[0] / this.unitFactor, next[1] / this.unitFactor]),
      ),
      onFrame((at) => this.frame(at)),
      () => observer.disconnect(),
    ]
    observer.observe(element)
  }

  destroy(): void {
    for (const one of this.unsubscribers) one()
    this.plot.destroy()
  }

  /** The present picture, for exports. */
  figure(title: string): Figure {
    const { plot, traces } = this
    const [min, max] = [plot.scales['y']?.min ?? 0, plot.scales['y']?.max ?? 1]
    const [from, to] = visibleTimes()
    const [x, ...columns] = scaled(this.columns, this.unitFactor)
    return {
      title,
      width: 760,
      height: 360,
      x: { min: from, max: to, label: 'Time, s' },
      y: { min, max, label: this.unit },
      lines: traces.map(({ tone, dash, label }, k) => ({
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
    const [from, to] = visibleTimes()
    const width = Math.max(Math.floor(this.plot.bbox.width / devicePixelRatio), 10)
    const live = useStudio.getState().run?.state === 'running'
    const { version, stepBacks, run } = samples
    const shapeKey = [
      run,
      stepBacks,
      from,
      to,
      width,
      this.plot.height,
      live,
      useUnits.getState().radians,
      String(this.valueRange.current.values),
    ].join(' ')
    const { on, at: triggerTime, level } = useTrigger.getState()
    const lineKey = [
      on && `${triggerTime} ${level}`,
      useCursor.getState().time,
      String(useWindow.getState().cursors),
      useRuns.getState().runs.at(-1)?.tunings.length,
    ].join(' ')
    const sameShape = shapeKey === this.shapeKey
    const sameLines = lineKey === this.lineKey
    if (sameShape && sameLines && version === this.examinedVersion) return
    if (sameShape && version === this.drawnVersion) {
      this.lineKey = lineKey
      this.plot.redraw(false, false)
    } else if (sameShape && sameLines && live && !mayDraw(at)) scheduleFrame()
    else {
      // During a run samples are only appended; after a step back everything is examined again.
      const previousExtremes = sameShape ? this.extremes : undefined
      const data = plotData(this.traces, from, to, width, previousExtremes)
      this.columns = data.columns
      this.extremes = data.extremes
      this.examinedVersion = version
      if (this.draw(data, previousExtremes, live && sameShape, sameLines, [from, to])) return
      this.drawnVersion = version
      this.shapeKey = shapeKey
      this.lineKey = lineKey
    }
  }

  /** Draw new samples; returns whether drawing only the new ones was sufficient. */
  private draw(
    data: PlotData,
    previousExtremes: Extremes | undefined,
    appendsOnly: boolean,
    sameLines: boolean,
    [from, to]: [number, number],
  ): boolean {
    const { plot, traces, columns, range } = this
    const width = Math.max(Math.floor(plot.bbox.width / devicePixelRatio), 10)
    const others = this.companions.length
      ? plotData(this.companions, from, to, width, undefined).columns
      : null
    const axisUnit = axisDisplayUnit(
      [...traces, ...this.companions],
      [columns[0], ...columns.slice(1), ...(others?.slice(1) ?? [])],
    )
    const requestedRange = this.valueRange.current.values
    const requiredRange: [number, number] = requestedRange
      ? [requestedRange[0] * axisUnit.factor, requestedRange[1] * axisUnit.factor]
      : rangeOf(others ? [columns, others] : [columns], axisUnit.factor, from, to)
    const sameFactor = axisUnit.factor === this.unitFactor
    const fitsRange = appendsOnly && requiredRange[0] >= range[0] && requiredRange[1] <= range[1]
    if (
      fitsRange &&
      sameLines &&
      sameFactor &&
      Boolean(data.extremes) === Boolean(previousExtremes) &&
      data.ends
    ) {
      this.drawing.append(columns, this.unitFactor, data.ends, devicePixelRatio)
      return true
    }
    this.range = fitsRange
      ? range
      : appendsOnly && sameFactor
        ? withGrowthMargin(requiredRange, range)
        : requiredRange
    this.unitFactor = axisUnit.factor
    this.unit =
      traces.length === 1 ? [traces[0]!.label, axisUnit.unit].filter(Boolean).join(', ') : axisUnit.unit
    const dashes = sharedDashes(columns, (this.range[1] - this.range[0]) / this.unitFactor)
    this.dashes = traces.map(({ dash }, k) => dashes[k] ?? dash)
    this.dashes.forEach((dash, k) => {
      plot.series[k + 1]!.dash = dash
    })
    this.drawing.setDashes(this.dashes)
    plot.batch(() => {
      plot.setData(scaled(columns, this.unitFactor), false)
      plot.setScale('x', { min: from, max: to })
      plot.setScale('y', { min: this.range[0], max: this.range[1] })
    })
    if (data.ends) this.drawing.reset(columns, data.ends)
    return false
  }
}

/** Unit and factor of the vertical axis if all traces have the same unit. */
function axisDisplayUnit(traces: Trace[], columns: PlotColumns): DisplayUnit {
  const [first, ...others] = traces
  if (!first || others.some(({ unit }) => unit !== first.unit)) return { factor: 1, unit: '' }
  let largest = 0
  for (const column of columns.slice(1))
    for (const value of column)
      if (typeof value === 'number' && Math.abs(value) > largest) largest = Math.abs(value)
  return displayUnit(first.unit, largest)
}

/** The data to draw; the rows of each trace before its end do not change during the run. */
interface PlotData {
  columns: PlotColumns
  ends?: number[]
  extremes?: Extremes
}

/** The data to draw in a window: samples if there are few, otherwise the extremes in each pixel. */
function plotData(
  traces: Trace[],
  from: number,
  to: number,
  width: number,
  previousExtremes: Extremes | undefined,
): PlotData {
  const recorded = traces.map(
    ({ read }) => read() ?? { time: new Float64Array(0), values: new Float64Array(0) },
  )
  const parts = recorded.map((one) => samplesBetween(one, from, to))
  if (parts.some(({ time }) => time.length > DENSE_SAMPLES * width)) {
    const computed = extremes(recorded, from, to, width, previousExtremes)
    return { columns: computed.columns, ends: computed.finalRows, extremes: computed }
  }
  const [first, ...others] = parts
  if (!first) return { columns: [new Float64Array(0)] }
  if (
    others.every(
      ({ time }) =>
        time.buffer === first.time.buffer &&
        time.length === first.time.length &&
        time.byteOffset === first.time.byteOffset,
    )
  )
    return {
      columns: [first.time, ...parts.map(({ values }) => values)],
      ends: parts.map(({ time }) => time.length),
    }
  return { columns: withCommonTimes(parts) }
}

function scaled(data: PlotColumns, unitFactor: number): PlotColumns {
  if (unitFactor === 1) return data
  const [time, ...columns] = data
  return [
    time,
    ...columns.map((column) =>
      column instanceof Float64Array
        ? column.map((v) => v * unitFactor)
        : column.map((v) => (typeof v === 'number' ? v * unitFactor : v)),
    ),
  ]
}

/** Minimum and maximum of the visible values, with a margin. */
function rangeOf(plots: PlotColumns[], unitFactor: number, from: number, to: number): [number, number] {
  let low = Infinity
  let high = -Infinity
  for (const [time, ...columns] of plots)
    for (const column of columns)
      for (let k = 0; k < time.length; k++) {
        const value = column[k]
        if (typeof value !== 'number' || !(time[k]! >= from && time[k]! <= to)) continue
        if (value < low) low = value
        if (value > high) high = value
      }
  return withMargin(low * unitFactor, high * unitFactor)
}
