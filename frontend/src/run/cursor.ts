import { create } from 'zustand'
import { changed, watch } from '../frames'
import { samples } from '../samples'
import { useStudio } from '../store'

interface Cursor {
  /** The time (s) that all views show; null is the end of the run. */
  time: number | null
  playing: boolean
  loop: boolean
  rate: number
}

/** One time cursor for scopes, values and the robot. */
export const useCursor = create<Cursor>(() => ({ time: null, playing: false, loop: false, rate: 1 }))

const reached = () => samples.time[samples.count - 1] ?? 0

/** The displayed time. */
export function shownTime(): number {
  return useCursor.getState().time ?? reached()
}

/** The frame (ms) in which the playback was last advanced; null without playback. */
let last: number | null = null

/** Advance the playback. It runs before all views, so that they draw the new time in the same frame. */
function move(now: number): void {
  const { playing, loop, time, rate } = useCursor.getState()
  if (playing && time !== null && last !== null) {
    const next = time + (rate * (now - last)) / 1000
    const end = reached()
    if (next < end) useCursor.setState({ time: next })
    else if (loop) useCursor.setState({ time: samples.time[0] ?? 0 })
    else useCursor.setState({ time: end, playing: false })
  }
  last = playing ? now : null
  if (playing) changed()
}
watch(move)
useCursor.subscribe(changed)

/** Play the recorded run from the cursor, or from the start if the cursor is at the end. */
export function play(): void {
  const from = shownTime()
  useCursor.setState({ playing: true, time: from >= reached() ? (samples.time[0] ?? 0) : from })
}

export function hold(): void {
  useCursor.setState({ playing: false })
}

/** Show an earlier or later sample. */
export function stepCursor(by: number): void {
  const shown = shownTime()
  let index = Math.min(Math.max(samples.indexAt(shown) + by, 0), samples.count - 1)
  while (by < 0 && index > 0 && samples.time[index] === shown) index-- // the other side of a jump
  if (index >= 0) useCursor.setState({ time: samples.time[index]!, playing: false })
}

/** Whether the run has ended. */
export function ended(): boolean {
  const { run } = useStudio.getState()
  return run !== null && run.state !== 'running' && run.state !== 'paused'
}
