import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useRef } from 'react'
import 'uplot/dist/uPlot.min.css'
import { changed } from '../frames'
import type { Trace } from '../model/trace'
import type { Figure } from './figure'
import { LivePlot, type SeenValues } from './live_plot'

/** The present content of a plot, for measures and exports. */
export interface PlotHandle {
  figure: () => Figure
}

interface Props extends SeenValues {
  traces: Trace[]
  hidden: ReadonlySet<string>
  title: string
  handle?: React.RefObject<PlotHandle | null>
  /** A band about zero: the tolerance of a difference. */
  band?: number
}

/** Traces over time. All time plots share zoom, measuring cursors and the displayed time. */
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
    const plot = new LivePlot(element, shown, band, held)
    if (handle) handle.current = { figure: () => plot.figure(title) }
    return () => plot.destroy()
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
