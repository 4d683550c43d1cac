import { firstAfter, firstNotBefore } from './time_index'
import type { RunSamples } from './run_samples'

/** One line of a plot. The arrays are read at each frame, because they grow during a run. */
export interface Trace {
  /** Identifies the line, independently of the other displayed lines. */
  key: string
  /** The recorded signal and the index of its element. */
  channel: string
  element: number
  label: string
  /** The signal and the entry in the label: a number, or a name such as the name of a joint. */
  stem: string
  entry: string
  unit: string
  /** Name of a custom property, `trace-0`. */
  tone: string
  dash: number[]
  read: () => { time: Float64Array; values: Float64Array } | undefined
}

export const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3]]
export const MAX_TRACES = 32

/**
 * The traces of some signals of a run. An element of a vector has the colour of its index in every view, so
 * that a joint has the same colour everywhere; scalars have different colours. Traces of equal colour have
 * different dashes.
 */
export function tracesOf(samples: RunSamples, paths: { path: string; label: string }[]): Trace[] {
  const usedTones = new Map<string, number>()
  let scalars = 0
  return paths
    .flatMap(({ path, label }) => {
      const recorded = samples.signal(path)
      if (!recorded) return []
      const name = label || samples.title(recorded.channel.name)
      return recorded.columns.map((_, element): Trace => {
        const single = recorded.columns.length === 1
        const tone = `trace-${(single ? scalars++ : element) % 8}`
        const sameTone = usedTones.get(tone) ?? 0
        usedTones.set(tone, sameTone + 1)
        const entry = single ? '' : (recorded.channel.entries[element] ?? String(element + 1))
        return {
          key: `${path} ${element}`,
          channel: recorded.channel.name,
          element,
          label: single ? name : `${name} ${entry}`,
          stem: name,
          entry,
          unit: recorded.channel.unit,
          tone,
          dash: DASHES[sameTone % DASHES.length]!,
          read: () => {
            const signal = samples.signal(path)
            const values = signal?.columns[element]
            return signal && values && { time: signal.time, values }
          },
        }
      })
    })
    .slice(0, MAX_TRACES)
}

/**
 * The label of a trace with another entry. Where a label is too long, the name of the signal is cut off and
 * the entry is shown completely, because the entry distinguishes the traces of one signal.
 */
export function withEntry({ stem }: Trace, parts: string[]): Pick<Trace, 'entry' | 'label'> {
  const entry = parts.filter(Boolean).join(', ')
  return { entry, label: `${stem} ${entry}` }
}

/** Whether the label of a trace consists of the signal and an entry. */
export const hasEntry = ({ entry, label, stem }: Trace): boolean =>
  entry !== '' && label === `${stem} ${entry}`

/** The traces of two charts; traces of the second chart have the same colours and dashes as in the first. */
export function sameTones(first: Trace[], second: Trace[]): [Trace[], Trace[]] {
  const known = new Map(first.map((trace) => [trace.key, trace]))
  const tones = (trace: Trace): Trace => {
    const { tone, dash } = known.get(trace.key) ?? trace
    return { ...trace, tone, dash }
  }
  return [first, second.map(tones)]
}

/** The columns of a plot: common times, and the values of each trace. */
export type PlotColumns = [Float64Array, ...(Float64Array | (number | null | undefined)[])[]]

/** The extremes of traces in the intervals of a window that are computed so far. */
export interface Extremes {
  from: number
  to: number
  width: number
  columns: PlotColumns
  /**
   * For each trace, the first sample of its last interval and the row of that interval: all rows before it
   * are final.
   */
  intervalStarts: number[]
  finalRows: number[]
}

/**
 * Minimum and maximum of each trace in each of `width` equal intervals of a time window: no more points than
 * visible pixels, and every peak is visible. Rows of the same window in `previous` are not computed again.
 */
export function extremes(
  traces: { time: Float64Array; values: Float64Array }[],
  from: number,
  to: number,
  width: number,
  previous?: Extremes,
): Extremes {
  const span = (to - from) / width
  const reusable =
    previous?.from === from &&
    previous.to === to &&
    previous.width === width &&
    previous.intervalStarts.length === traces.length
      ? previous
      : undefined
  const time = reusable
    ? reusable.columns[0]
    : new Float64Array(2 * width).map((_, k) => from + (Math.floor(k / 2) + (k % 2 ? 0.75 : 0.25)) * span)
  const intervalStarts: number[] = []
  const finalRows: number[] = []
  const columns = traces.map(({ time: times, values }, trace) => {
    const column = reusable
      ? (reusable.columns[trace + 1] as (number | undefined)[])
      : Array.from({ length: 2 * width }, (): number | undefined => undefined)
    // One more sample on each side, so that lines leave the window at the correct height.
    let row = reusable ? reusable.intervalStarts[trace]! : Math.max(firstAfter(times, from) - 1, 0)
    let begin = row
    let last = reusable ? reusable.finalRows[trace]! : 0
    const end = Math.min(firstAfter(times, to) + 1, times.length)
    while (row < end) {
      begin = row
      const k = Math.min(Math.max(Math.floor((times[row]! - from) / span), 0), width - 1)
      last = 2 * k
      const intervalEnd = k === width - 1 ? Infinity : from + (k + 1) * span
      let low = row
      let high = row
      do {
        if (values[row]! < values[low]!) low = row
        if (values[row]! > values[high]!) high = row
        row++
      } while (row < end && times[row]! < intervalEnd)
      column[2 * k] = values[Math.min(low, high)]
      column[2 * k + 1] = values[Math.max(low, high)]
    }
    intervalStarts.push(begin)
    finalRows.push(last)
    return column
  })
  return { from, to, width, columns: [time, ...columns], intervalStarts, finalRows }
}

/** The recorded samples of a trace in a time window, with one more on each side. */
export function samplesBetween(
  { time, values }: { time: Float64Array; values: Float64Array },
  from: number,
  to: number,
) {
  const begin = Math.max(firstAfter(time, from) - 1, 0)
  const end = Math.min(firstAfter(time, to) + 1, time.length)
  return { time: time.subarray(begin, end), values: values.subarray(begin, end) }
}

/** The left limit at a time, linearly interpolated; NaN outside the samples. */
export function valueBefore(trace: { time: Float64Array; values: Float64Array }, queryTime: number): number {
  const first = firstNotBefore(trace.time, queryTime)
  return trace.time[first] === queryTime ? trace.values[first]! : valueAt(trace, queryTime)
}

/**
 * Traces with a common column of times. Each time has as many rows as the trace with the most samples at this
 * time: two at a jump. A trace with one sample has its value in both rows; a trace without one has no value.
 */
export function withCommonTimes(traces: { time: Float64Array; values: Float64Array }[]): PlotColumns {
  const position = traces.map(() => 0)
  const times: number[] = []
  const columns = traces.map((): (number | undefined)[] => [])
  for (;;) {
    const nextTime = Math.min(...traces.map(({ time }, k) => time[position[k]!] ?? Infinity))
    if (nextTime === Infinity) break
    const rows = traces.map(({ time }, k) => {
      let count = 0
      while (time[position[k]! + count] === nextTime) count++
      return count
    })
    const rowCount = Math.max(...rows)
    for (let row = 0; row < rowCount; row++) {
      times.push(nextTime)
      traces.forEach(({ values }, k) =>
        columns[k]!.push(rows[k] ? values[position[k]! + Math.min(row, rows[k] - 1)] : undefined),
      )
    }
    rows.forEach((count, k) => (position[k]! += count))
  }
  return [Float64Array.from(times), ...columns]
}

/** The linearly interpolated value at a time, after a jump there; NaN outside the samples. */
export function valueAt(
  { time, values }: { time: Float64Array; values: Float64Array },
  queryTime: number,
): number {
  const firstLater = firstAfter(time, queryTime)
  if (firstLater === 0 || (firstLater === time.length && time[firstLater - 1] !== queryTime)) return NaN
  const t0 = time[firstLater - 1]!
  const y0 = values[firstLater - 1]!
  if (t0 === queryTime || firstLater === time.length) return y0
  return y0 + ((values[firstLater]! - y0) * (queryTime - t0)) / (time[firstLater]! - t0)
}
