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

const cache = new Map<string, Difference>()
const MAX_CACHED = 256

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
  const cached = cache.get(key)
  if (cached) return cached
  const a = baseline.signal(path)
  const b = compared.signal(path)
  if (!a?.columns[element] || !b?.columns[element]) return undefined
  const computed = sampledDifference(a, b, element)
  if (cache.size >= MAX_CACHED) cache.clear()
  cache.set(key, computed)
  return computed
}

function sampledDifference(a: Signal, b: Signal, element: number): Difference {
  const first = a.columns[element]!
  const second = { time: b.time, values: b.columns[element]! }
  const times: number[] = []
  const values: number[] = []
  let largest = 0
  let timeOfLargest = NaN
  for (let k = 0; k < first.length; k++) {
    const time = a.time[k]!
    const isLeftLimit = a.time[k + 1] === time
    const comparedValue = isLeftLimit ? valueBefore(second, time) : valueAt(second, time)
    if (Number.isNaN(comparedValue)) continue
    const deviation = comparedValue - first[k]!
    times.push(time)
    values.push(deviation)
    if (Math.abs(deviation) > largest || Number.isNaN(timeOfLargest)) {
      largest = Math.abs(deviation)
      timeOfLargest = time
    }
  }
  return { time: Float64Array.from(times), values: Float64Array.from(values), largest, at: timeOfLargest }
}

/** The largest difference in all elements of a signal, and its time (s). */
export function largestDifference(
  baseline: RunSamples,
  compared: RunSamples,
  path: string,
): { largest: number; at: number } | undefined {
  const signal = baseline.signal(path)
  let greatest: { largest: number; at: number } | undefined
  signal?.columns.forEach((_, element) => {
    const elementDifference = difference(baseline, compared, path, element)
    if (elementDifference && (!greatest || elementDifference.largest > greatest.largest))
      greatest = elementDifference
  })
  return greatest
}
