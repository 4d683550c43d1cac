import { create } from 'zustand'
import { scheduleFrame } from '../frames'

/** A slider: name, unit and range of one coordinate. */
export interface SliderOfJoint {
  name: string
  unit: string
  low: number
  high: number
}

interface Joints {
  q: number[]
  poses: number[][][]
  /** The number of received poses; views are drawn again when it changes. */
  count: number
  /** Whether the Python program is connected. */
  live: boolean
}

/** The coordinates at the sliders, and the poses that Python has computed. */
export const useJoints = create<Joints>(() => ({ q: [], poses: [], count: 0, live: true }))

/** Time after which a request without a reply no longer prevents the next request. */
const REPLY_MS = 2000

let awaitedSince = -Infinity
let unsent = false
let send: (q: number[]) => void = () => {}

/** Set the function that sends coordinates to Python. */
export function onJoints(sender: (q: number[]) => void): void {
  send = sender
}

/**
 * Move a slider. While the poses of an earlier movement are awaited, only the latest coordinates are stored.
 */
export function moveJoint(index: number, value: number): void {
  useJoints.setState(({ q }) => ({ q: q.map((old, k) => (k === index ? value : old)) }))
  unsent = true
  sendLatest()
}

function sendLatest(): void {
  const now = performance.now()
  if (!unsent || now - awaitedSince < REPLY_MS) return
  unsent = false
  awaitedSince = now
  send(useJoints.getState().q)
}

/** Show poses and coordinates from Python. Coordinates are ignored if a slider has moved meanwhile. */
export function receivePoses(q: number[], poses: number[][][]): void {
  awaitedSince = -Infinity
  useJoints.setState(({ count, q: shown }) => ({ q: unsent ? shown : q, poses, count: count + 1 }))
  scheduleFrame()
  sendLatest()
}
