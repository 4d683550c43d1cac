import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import { scheduleFrame, onFrame } from '../frames'
import { shownTime } from '../run/cursor'
import { mayDraw } from '../run/pace'
import { samples } from '../samples'
import { useStudio } from '../store'
import { withMargin } from '../model/axis_range'
import { paint, type Figure } from './figure'
import { displayUnit, useUnits } from './quantity'
import type { PlotHandle } from './plot'
import type { Trace } from '../model/trace'

const MAX_POINTS = 20_000

/** The second trace over the first, with a mark at the displayed time. */
function figureOf(
  [xTrace, yTrace]: Trace[],
  title: string,
  width: number,
  height: number,
  equal: boolean,
): Figure {
  const x = xTrace?.read()?.values ?? new Float64Array(0)
  const y = yTrace?.read()?.values ?? new Float64Array(0)
  const largest = (values: Float64Array) =>
    values.reduce((greatest, value) => Math.max(greatest, Math.abs(value)), 0)
  // Signals of the same unit have the same prefix, so that equal axes have equal scales.
  const commonLargest = xTrace?.unit === yTrace?.unit ? Math.max(largest(x), largest(y)) : undefined
  const xUnit = displayUnit(xTrace?.unit ?? '', commonLargest ?? largest(x))
  const yUnit = displayUnit(yTrace?.unit ?? '', commonLargest ?? largest(y))
  // For a long run every k-th point and the last one are drawn.
  const stride = Math.max(1, Math.ceil(x.length / MAX_POINTS))
  const count = Math.ceil(x.length / stride)
  const pick = (values: Float64Array, factor: number) =>
    Float64Array.from(
      { length: count },
      (_, k) => values[k === count - 1 ? values.length - 1 : k * stride]! * factor,
    )
  const [xs, ys] = [pick(x, xUnit.factor), pick(y, yUnit.factor)]
  const range = (values: Float64Array) =>
    withMargin(
      values.reduce((a, b) => Math.min(a, b), Infinity),
      values.reduce((a, b) => Math.max(a, b), -Infinity),
    )
  const axis = (values: Float64Array, trace: Trace | undefined, unit: string) => {
    const [min, max] = range(values)
    return { min, max, label: [trace?.label, unit].filter(Boolean).join(', ') }
  }
  const sampleIndex = samples.indexAt(shownTime())
  return {
    title,
    width,
    height,
    equal,
    x: axis(xs, xTrace, xUnit.unit),
    y: axis(ys, yTrace, yUnit.unit),
    lines: [{ tone: 'trace-0', dash: [], label: title, x: xs, y: ys }],
    mark:
      sampleIndex >= 0 && sampleIndex < x.length
        ? [x[sampleIndex]! * xUnit.factor, y[sampleIndex]! * yUnit.factor]
        : undefined,
  }
}

/** Whether the axes of two signals can have the same scale, and whether they initially have it. */
export function equalAxes([x, y]: Trace[]): { possible: boolean; initial: boolean } {
  const possible = x?.unit === y?.unit
  return { possible, initial: possible && Boolean(x?.unit) }
}

export function XyPlot({
  traces,
  title,
  equal,
  handle,
}: {
  traces: Trace[]
  title: string
  /** Whether both axes have the same scale. */
  equal: boolean
  handle: React.RefObject<PlotHandle | null>
}) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const scheme = useComputedColorScheme('light')
  useEffect(() => {
    const element = canvas.current
    const container = element?.parentElement
    if (!element || !container) return
    let drawnState = ''
    const frame = (at: number) => {
      if (!container.isConnected) return // hidden by another panel
      const { clientWidth: width, clientHeight: height } = container
      const state = `${samples.version} ${shownTime()} ${width} ${height} ${useUnits.getState().radians}`
      if (state === drawnState || width < 40 || height < 40) return
      if (useStudio.getState().run?.state === 'running' && !mayDraw(at)) {
        scheduleFrame()
        return
      }
      drawnState = state
      element.width = width * devicePixelRatio
      element.height = height * devicePixelRatio
      paint(figureOf(traces, '', width, height, equal), element, devicePixelRatio)
    }
    const unsubscribe = onFrame(frame)
    const observer = new ResizeObserver(scheduleFrame)
    observer.observe(container)
    handle.current = { figure: () => figureOf(traces, title, 520, 480, equal) }
    return () => {
      unsubscribe()
      observer.disconnect()
    }
  }, [traces, title, scheme, handle, equal])
  return (
    <div
      className="plot xy"
      role="img"
      aria-label={`${title}: ${traces.map(({ label }) => label).join(' and ')}`}
    >
      <canvas ref={canvas} />
    </div>
  )
}
