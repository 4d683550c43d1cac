import { create } from 'zustand'
import { scheduleFrame, onFrame } from '../frames'
import { samples } from '../samples'

interface Cursor {
  /** The time (s) that all views show; null is the end of the run. */
  time: number | null
  playing: boolean
  loop: boolean
  rate: number
}

/** One time cursor for scopes, values and the robot. */
export const useCursor = create<Cursor>(() => ({ time: null, playing: false, loop: false, rate: 1 }))

const lastTime = () => samples.time[samples.count - 1] ?? 0

/** The displayed time. */
export function shownTime(): number {
  return useCursor.getState().time ?? lastTime()
}

/** The frame (ms) in which the playback was last advanced; null without playback. */
let lastFrame: number | null = null

/** Advance the playback. It runs before all views, so that they draw the new time in the same frame. */
function advance(now: number): void {
  const { playing, loop, time, rate } = useCursor.getState()
  if (playing && time !== null && lastFrame !== null) {
    const next = time + (rate * (now - lastFrame)) / 1000
    const end = lastTime()
    if (next < end) useCursor.setState({ time: next })
    else if (loop) useCursor.setState({ time: samples.time[0] ?? 0 })
    else useCursor.setState({ time: end, playing: false })
  }
  lastFrame = playing ? now : null
  if (playing) scheduleFrame()
}
onFrame(advance)
useCursor.subscribe(scheduleFrame)

/** Play the recorded run from the cursor, or from the start if the cursor is at the end. */
export function play(): void {
  const start = shownTime()
  useCursor.setState({ playing: true, time: start >= lastTime() ? (samples.time[0] ?? 0) : start })
}

export function pausePlayback(): void {
  useCursor.setState({ playing: false })
}

/** Show an earlier or later sample. */
export function stepCursor(steps: number): void {
  const time = shownTime()
  let index = Math.min(Math.max(samples.indexAt(time) + steps, 0), samples.count - 1)
  while (steps < 0 && index > 0 && samples.time[index] === time) index-- // the other side of a jump
  if (index >= 0) useCursor.setState({ time: samples.time[index]!, playing: false })
}
