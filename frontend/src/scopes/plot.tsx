import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import 'uplot/dist/uPlot.min.css'
import { scheduleFrame } from '../frames'
import type { Trace } from '../model/trace'
import type { Figure } from './figure'
import { LivePlot, type ValueRange } from './live_plot'

/** The present content of a plot, for measures and exports. */
export interface PlotHandle {
  figure: () => Figure
}

interface Props extends ValueRange {
  traces: Trace[]
  hidden: ReadonlySet<string>
  title: string
  handle?: React.RefObject<PlotHandle | null>
  /** A band about zero: the tolerance of a difference. */
  band?: number
  /** Traces of another plot whose value axis is to be the same. */
  companions?: Trace[]
}

/** Traces over time. All time plots share zoom, measuring cursors and the displayed time. */
export function Plot({ traces, hidden, title, handle, band, companions, values, onValues }: Props) {
  const container = useRef<HTMLDivElement>(null)
  const valueRange = useRef({ values, onValues })
  valueRange.current = { values, onValues }
  const scheme = useComputedColorScheme('light')
  const visibleTraces = traces.filter(({ key }) => !hidden.has(key))
  const tracesKey = visibleTraces.map(({ key, tone, dash }) => `${key} ${tone} ${dash.join()}`).join('\n')
  const visibleCompanions = companions?.filter(({ key }) => !hidden.has(key))
  const companionsKey = visibleCompanions?.map(({ key }) => key).join('\n')
  useEffect(() => {
    const element = container.current
    if (!element) return
    const plot = new LivePlot(element, visibleTraces, band, valueRange, visibleCompanions)
    if (handle) handle.current = { figure: () => plot.figure(title) }
    return () => plot.destroy()
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [tracesKey, companionsKey, scheme, title, band])
  useEffect(scheduleFrame, [values])
  return (
    <div
      ref={container}
      className="plot"
      role="img"
      aria-label={`${title}: ${visibleTraces.map(({ label }) => label).join(', ')}`}
    />
  )
}
