import type { RunSamples, Signal } from './run_samples'
import { valueAt, valueBefore } from './trace'

/** The difference between two runs in one element of a signal. */
export interface Difference {
  time: Float64Array
  values: Float64Array
  /** The maximum of |difference|, and its time. */
  largest: number
  at: number
}

const known = new Map<string, Difference>()
const MOST_KNOWN = 256

/**
 * `compared - baseline` at the times of the baseline, where both have values, on both sides of its jumps.
 * The compared run is interpolated linearly between its samples.
 */
export function difference(
  baseline: RunSamples,
  compared: RunSamples,
  path: string,
  element: number,
): Difference | undefined {
  const key = `${baseline.version} ${compared.version} ${path} ${element}`
  const before = known.get(key)
  if (before) return before
  const a = baseline.signal(path)
  const b = compared.signal(path)
  if (!a?.columns[element] || !b?.columns[element]) return undefined
  const found = between(a, b, element)
  if (known.size >= MOST_KNOWN) known.clear()
  known.set(key, found)
  return found
}

function between(a: Signal, b: Signal, element: number): Difference {
  const first = a.columns[element]!
  const second = { time: b.time, values: b.columns[element]! }
  const times: number[] = []
  const values: number[] = []
  let largest = 0
  let at = NaN
  for (let k = 0; k < first.length; k++) {
    const time = a.time[k]!
    const left = a.time[k + 1] === time
    const other = left ? valueBefore(second, time) : valueAt(second, time)
    if (Number.isNaN(other)) continue
    const apart = other - first[k]!
    times.push(time)
    values.push(apart)
    if (Math.abs(apart) > largest || Number.isNaN(at)) {
      largest = Math.abs(apart)
      at = time
    }
  }
  return { time: Float64Array.from(times), values: Float64Array.from(values), largest, at }
}

/** The element of a signal with the largest difference. */
export function farthest(
  baseline: RunSamples,
  compared: RunSamples,
  path: string,
): { largest: number; at: number } | undefined {
  const found = baseline.signal(path)
  let worst: { largest: number; at: number } | undefined
  found?.columns.forEach((_, element) => {
    const one = difference(baseline, compared, path, element)
    if (one && (!worst || one.largest > worst.largest)) worst = one
  })
  return worst
}
