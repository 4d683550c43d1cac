import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import { changed, watch } from '../frames'
import { shownTime } from '../run/cursor'
import { mayFollow } from '../run/pace'
import { samples } from '../samples'
import { useStudio } from '../store'
import { aired, paint, type Figure } from './figure'
import { reading, useUnits } from './quantity'
import type { PlotHandle } from './plot'
import type { Trace } from '../model/trace'

const MOST_POINTS = 20_000

/** The second trace over the first, with a mark at the displayed time. */
function figureOf([across, up]: Trace[], title: string, width: number, height: number): Figure {
  const x = across?.read()?.values ?? new Float64Array(0)
  const y = up?.read()?.values ?? new Float64Array(0)
  const largest = (values: Float64Array) => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0)
  const equal = Boolean(across?.unit) && across?.unit === up?.unit
  const most = Math.max(largest(x), largest(y))
  const readX = reading(across?.unit ?? '', equal ? most : largest(x))
  const readY = reading(up?.unit ?? '', equal ? most : largest(y))
  // For a long run every k-th point and the last one are drawn.
  const stride = Math.max(1, Math.ceil(x.length / MOST_POINTS))
  const count = Math.ceil(x.length / stride)
  const pick = (values: Float64Array, factor: number) =>
    Float64Array.from(
      { length: count },
      (_, k) => values[k === count - 1 ? values.length - 1 : k * stride]! * factor,
    )
  const [xs, ys] = [pick(x, readX.factor), pick(y, readY.factor)]
  const range = (values: Float64Array) =>
    aired(
      values.reduce((a, b) => Math.min(a, b), Infinity),
      values.reduce((a, b) => Math.max(a, b), -Infinity),
    )
  const axis = (values: Float64Array, trace: Trace | undefined, unit: string) => {
    const [min, max] = range(values)
    return { min, max, label: [trace?.label, unit].filter(Boolean).join(', ') }
  }
  const now = samples.indexAt(shownTime())
  return {
    title,
    width,
    height,
    equal,
    x: axis(xs, across, readX.unit),
    y: axis(ys, up, readY.unit),
    lines: [{ tone: 'trace-0', dash: [], label: title, x: xs, y: ys }],
    mark: now >= 0 && now < x.length ? [x[now]! * readX.factor, y[now]! * readY.factor] : undefined,
  }
}

export function XyPlot({
  traces,
  title,
  handle,
}: {
  traces: Trace[]
  title: string
  handle: React.RefObject<PlotHandle | null>
}) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const scheme = useComputedColorScheme('light')
  useEffect(() => {
    const element = canvas.current
    const box = element?.parentElement
    if (!element || !box) return
    let seen = ''
    const frame = (at: number) => {
      if (!box.isConnected) return // hidden by another panel
      const { clientWidth: width, clientHeight: height } = box
      const now = `${samples.version} ${shownTime()} ${width} ${height} ${useUnits.getState().radians}`
      if (now === seen || width < 40 || height < 40) return
      if (useStudio.getState().run?.state === 'running' && !mayFollow(at)) {
        changed()
        return
      }
      seen = now
      element.width = width * devicePixelRatio
      element.height = height * devicePixelRatio
      paint(figureOf(traces, '', width, height), element, devicePixelRatio)
    }
    const leave = watch(frame)
    const sized = new ResizeObserver(changed)
    sized.observe(box)
    handle.current = { figure: () => figureOf(traces, title, 520, 480) }
    return () => {
      leave()
      sized.disconnect()
    }
  }, [traces, title, scheme, handle])
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
