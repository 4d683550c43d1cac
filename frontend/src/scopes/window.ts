import { create } from 'zustand'
import { scheduleFrame } from '../frames'
import { samples } from '../samples'
import { useStudio } from '../store'

interface TimeWindow {
  /** The visible time range (s) of all time plots; null is the whole run. */
  range: [number, number] | null
  /** The two measuring cursors (s); null without measurement. */
  cursors: [number, number] | null
  /** Whether the tables of measures are visible. */
  measuring: boolean
}

/** Zoom and measuring cursors, shared by all time plots. */
export const useWindow = create<TimeWindow>(() => ({ range: null, cursors: null, measuring: false }))
useWindow.subscribe(scheduleFrame)
useStudio.subscribe(({ document }, before) => {
  if (document?.state.document !== before.document?.state.document)
    useWindow.setState({ range: null, cursors: null })
})

/** The range of the whole run: up to its stop time while it runs, otherwise up to its last sample. */
export function wholeRun(): [number, number] {
  const { run } = useStudio.getState()
  const lastTime = samples.time[samples.count - 1] ?? 0
  if (!run || run.state === 'running' || run.state === 'paused') return [0, run?.stopTime || lastTime || 1]
  return [Math.min(samples.time[0] ?? 0, lastTime), lastTime || 1]
}

/** The visible range. */
export function visibleTimes(): [number, number] {
  return useWindow.getState().range ?? wholeRun()
}

/** Minimum visible range, relative to its end; absolute (s) below 1 s. */
const MIN_SPAN = 1e-9

export function zoomTo(from: number, to: number): void {
  if (to - from > MIN_SPAN * Math.max(1, Math.abs(to))) useWindow.setState({ range: [from, to] })
}

/** Zoom about a time that keeps its position. */
export function zoomBy(factor: number, centre: number): void {
  const [from, to] = visibleTimes()
  const [first, last] = wholeRun()
  const span = (to - from) * factor
  if (span >= last - first) useWindow.setState({ range: null })
  else zoomTo(centre - ((centre - from) / (to - from)) * span, centre + ((to - centre) / (to - from)) * span)
}

export function pan(shift: number): void {
  const [from, to] = visibleTimes()
  useWindow.setState({ range: [from + shift, to + shift] })
}

/** Place two cursors at one third and two thirds of the visible range, or remove them. */
export function toggleCursors(): void {
  const [from, to] = visibleTimes()
  useWindow.setState((s) => ({
    cursors: s.cursors ? null : [from + (to - from) / 3, from + (2 * (to - from)) / 3],
  }))
}
