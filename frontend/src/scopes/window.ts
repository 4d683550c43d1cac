import { create } from 'zustand'
import { changed } from '../frames'
import { samples } from '../samples'
import { useStudio } from '../store'

interface Window {
  /** The visible time range (s) of all time plots; null is the whole run. */
  range: [number, number] | null
  /** The two measuring cursors (s); null without measurement. */
  cursors: [number, number] | null
  /** Whether the tables of measures are visible. */
  measuring: boolean
}

/** Zoom and measuring cursors, shared by all time plots. */
export const useWindow = create<Window>(() => ({ range: null, cursors: null, measuring: false }))
useWindow.subscribe(changed)
useStudio.subscribe(({ document }, before) => {
  if (document?.state.document !== before.document?.state.document)
    useWindow.setState({ range: null, cursors: null })
})

/** The range of the whole run: up to its stop time while it runs, otherwise up to its last sample. */
export function wholeRun(): [number, number] {
  const { run } = useStudio.getState()
  const reached = samples.time[samples.count - 1] ?? 0
  if (!run || run.state === 'running' || run.state === 'paused') return [0, run?.stopTime || reached || 1]
  return [Math.min(samples.time[0] ?? 0, reached), reached || 1]
}

/** The visible range. */
export function shownWindow(): [number, number] {
  return useWindow.getState().range ?? wholeRun()
}

const LEAST_SPAN = 1e-9

export function zoomTo(from: number, to: number): void {
  if (to - from > LEAST_SPAN * Math.max(1, Math.abs(to))) useWindow.setState({ range: [from, to] })
}

/** Zoom about a time that keeps its position. */
export function zoomBy(factor: number, about: number): void {
  const [from, to] = shownWindow()
  const [first, last] = wholeRun()
  const span = (to - from) * factor
  if (span >= last - first) useWindow.setState({ range: null })
  else zoomTo(about - ((about - from) / (to - from)) * span, about + ((to - about) / (to - from)) * span)
}

export function pan(by: number): void {
  const [from, to] = shownWindow()
  useWindow.setState({ range: [from + by, to + by] })
}

/** Place two cursors at one third and two thirds of the visible range, or remove them. */
export function toggleCursors(): void {
  const [from, to] = shownWindow()
  useWindow.setState((s) => ({
    cursors: s.cursors ? null : [from + (to - from) / 3, from + (2 * (to - from)) / 3],
  }))
}
