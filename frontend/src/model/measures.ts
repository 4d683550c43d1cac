import { firstAfter } from './time_index'
import { valueAt } from './trace'

/** The measures of one trace in a time window. `NaN`: undefined. */
export interface Measures {
  minimum: number
  maximum: number
  mean: number
  rms: number
  peakToPeak: number
  /** Time from 10 to 90 % of the change between first and last value, s. */
  riseTime: number
  /** Overshoot beyond the last value, relative to the step. */
  overshoot: number
}

/**
 * A trace has settled if it stays near its last value during the final fraction of the window. The allowed
 * deviation is a fraction of the change from the first to the last value.
 */
const FINAL_FRACTION = 0.05
const SETTLED_BAND = 0.02

/**
 * Measures of the linearly interpolated samples in a time window. Mean and RMS are weighted by time, so that
 * uneven sampling does not affect them: between samples a and b the integral of y² is dt (a² + ab + b²) / 3.
 */
export function measures(
  trace: { time: Float64Array; values: Float64Array },
  from: number,
  to: number,
): Measures {
  const { time, values } = samplesInWindow(trace, from, to)
  const count = time.length
  const undefinedMeasures = {
    minimum: NaN,
    maximum: NaN,
    mean: NaN,
    rms: NaN,
    peakToPeak: NaN,
    riseTime: NaN,
    overshoot: NaN,
  }
  if (!count) return undefinedMeasures
  let minimum = values[0]!
  let maximum = values[0]!
  let area = 0
  let square = 0
  for (let k = 1; k < count; k++) {
    const a = values[k - 1]!
    const b = values[k]!
    const dt = time[k]! - time[k - 1]!
    if (b < minimum) minimum = b
    if (b > maximum) maximum = b
    area += (dt * (a + b)) / 2
    square += (dt * (a * a + a * b + b * b)) / 3
  }
  const span = time[count - 1]! - time[0]!
  return {
    minimum,
    maximum,
    mean: span > 0 ? area / span : values[0]!,
    rms: span > 0 ? Math.sqrt(square / span) : Math.abs(values[0]!),
    peakToPeak: maximum - minimum,
    ...step(time, values, minimum, maximum),
  }
}

/** Rise time and overshoot; NaN if the trace has not settled, or if its first and last values are equal. */
function step(
  time: Float64Array,
  values: Float64Array,
  minimum: number,
  maximum: number,
): { riseTime: number; overshoot: number } {
  const count = values.length
  const first = values[0]!
  const last = values[count - 1]!
  const change = last - first
  const band = SETTLED_BAND * Math.abs(change)
  const finalPart = time[count - 1]! - FINAL_FRACTION * (time[count - 1]! - time[0]!)
  for (let k = count - 1; k >= 0 && time[k]! >= finalPart; k--)
    if (!(Math.abs(values[k]! - last) <= band)) return { riseTime: NaN, overshoot: NaN }
  if (!(Math.abs(change) > 1e-9 * Math.max(Math.abs(first), Math.abs(last))) || change === 0)
    return { riseTime: NaN, overshoot: NaN }
  const peak = change > 0 ? maximum - last : last - minimum
  return {
    riseTime:
      crossing(time, values, first + 0.9 * change, change) -
      crossing(time, values, first + 0.1 * change, change),
    overshoot: peak / Math.abs(change),
  }
}

/** The first time at which the trace reaches a level, in the direction of the step. */
function crossing(time: Float64Array, values: Float64Array, level: number, change: number): number {
  for (let k = 1; k < values.length; k++) {
    const a = values[k - 1]!
    const b = values[k]!
    if (change > 0 ? a < level && b >= level : a > level && b <= level)
      return time[k - 1]! + ((level - a) / (b - a)) * (time[k]! - time[k - 1]!)
  }
  return NaN
}

/** The part of a trace between two times; its ends are interpolated. */
function samplesInWindow(trace: { time: Float64Array; values: Float64Array }, from: number, to: number) {
  const { time, values } = trace
  const begin = Math.max(from, time[0] ?? Infinity)
  const end = Math.min(to, time[time.length - 1] ?? -Infinity)
  if (!(end >= begin)) return { time: new Float64Array(0), values: new Float64Array(0) }
  const first = firstAfter(time, begin)
  const last = firstAfter(time, end)
  const withEnds = (column: Float64Array, before: number, after: number) => {
    const values = new Float64Array(last - first + 2)
    values[0] = before
    values.set(column.subarray(first, last), 1)
    values[values.length - 1] = after
    return values
  }
  return {
    time: withEnds(time, begin, end),
    values: withEnds(values, valueAt(trace, begin), valueAt(trace, end)),
  }
}
