import { create } from 'zustand'
import { samples } from '../samples'
import { useStudio } from '../store'

interface Cursor {
  /** The instant (s) that every view shows; null follows the end of the run. */
  time: number | null
  playing: boolean
  rate: number
}

/** One time cursor for scopes, values and the robot. */
export const useCursor = create<Cursor>(() => ({ time: null, playing: false, rate: 1 }))

/** The instant to show now. */
export function shownTime(): number {
  const { time } = useCursor.getState()
  return time ?? samples.time[samples.count - 1] ?? 0
}

let last = 0

function tick(now: number): void {
  const { playing, time, rate } = useCursor.getState()
  const stop = useStudio.getState().run?.stopTime ?? 0
  if (playing && time !== null) {
    const next = time + (rate * (now - last)) / 1000
    useCursor.setState(next >= stop ? { time: stop, playing: false } : { time: next })
  }
  last = now
  requestAnimationFrame(tick)
}
requestAnimationFrame(tick)

/** Play the recorded run from the cursor, from the start where it stands at the end. */
export function play(): void {
  const stop = useStudio.getState().run?.stopTime ?? 0
  const from = shownTime()
  useCursor.setState({ playing: true, time: from >= stop ? 0 : from })
}
