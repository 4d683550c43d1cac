import { useEffect, useRef, useState } from 'react'
import { shownTime, useCursor } from '../run/cursor'
import { samples } from '../samples'
import { measures, type Measures } from '../model/measures'
import { formatNumber, displayUnit, withUnit } from './quantity'
import { hasEntry, valueAt, type Trace } from '../model/trace'
import { visibleTimes, useWindow } from './window'
import './measure_table.css'

const REFRESH_MS = 200
const ROWS: [name: keyof Measures, head: string, title: string][] = [
  ['minimum', 'min', 'minimum'],
  ['maximum', 'max', 'maximum'],
  ['mean', 'mean', 'mean over time'],
  ['rms', 'RMS', 'root mean square over time'],
  ['peakToPeak', 'p–p', 'peak-to-peak value'],
  ['riseTime', 'rise', 'rise time from 10 % to 90 %, if the signal settles'],
  ['overshoot', 'over', 'overshoot beyond the last value, relative to the step'],
]

/** Render at most a few times a second during changes; samples do not pass through React's state. */
function useRefresh(): void {
  const [, setCount] = useState(0)
  const lastState = useRef('')
  useEffect(() => {
    const timer = setInterval(() => {
      const { cursors, range } = useWindow.getState()
      const state = `${samples.version} ${String(cursors)} ${String(range)} ${useCursor.getState().time}`
      if (state === lastState.current) return
      lastState.current = state
      setCount((count) => count + 1)
    }, REFRESH_MS)
    return () => clearInterval(timer)
  }, [])
}

/** The measures of one plot's traces: values at the cursors, and measures of the visible range. */
export function MeasureTable({ traces }: { traces: Trace[] }) {
  useRefresh()
  const cursors = useWindow((s) => s.cursors)
  const measuring = useWindow((s) => s.measuring)
  const [from, to] = visibleTimes()
  const now = shownTime()
  const read = traces
    .map((trace) => ({ trace, data: trace.read() }))
    .flatMap(({ trace, data }) => (data ? [{ trace, data }] : []))
  return (
    <div className="measures" tabIndex={0} role="region" aria-label="Measures">
      {cursors && (
        <p className="between">
          <span>A {withUnit(cursors[0], 's', 5)}</span>
          <span>B {withUnit(cursors[1], 's', 5)}</span>
          <span>Δt {withUnit(cursors[1] - cursors[0], 's', 5)}</span>
          {cursors[1] !== cursors[0] && (
            <span>1/Δt {withUnit(1 / Math.abs(cursors[1] - cursors[0]), 'Hz', 5)}</span>
          )}
        </p>
      )}
      <table className={measuring ? 'numbers all-measures' : 'numbers'}>
        <thead>
          <tr>
            <th scope="col">signal</th>
            {cursors ? (
              ['A', 'B', 'Δ'].map((head) => (
                <th key={head} scope="col">
                  {head}
                </th>
              ))
            ) : (
              <th scope="col">at {formatNumber(now, 4)} s</th>
            )}
            {measuring &&
              ROWS.map(([name, head, title]) => (
                <th key={name} scope="col" title={title}>
                  {head}
                </th>
              ))}
          </tr>
        </thead>
        <tbody>
          {read.map(({ trace, data }) => (
            <Row key={trace.key} trace={trace} data={data} now={now} window={measuring ? [from, to] : null} />
          ))}
        </tbody>
      </table>
    </div>
  )
}

interface Data {
  time: Float64Array
  values: Float64Array
}

/** One trace: its value at the cursors or now, and its measures in a time window. */
function Row({
  trace,
  data,
  now,
  window,
}: {
  trace: Trace
  data: Data
  now: number
  window: [number, number] | null
}) {
  const cursors = useWindow((s) => s.cursors)
  const measured = window ? measures(data, ...window) : undefined
  const [a, b] = cursors
    ? [valueAt(data, cursors[0]), valueAt(data, cursors[1])]
    : [valueAt(data, Math.min(now, data.time.at(-1) ?? 0)), NaN]
  const largest = Math.max(
    ...[a, b, measured?.minimum, measured?.maximum]
      .filter((v) => v !== undefined && Number.isFinite(v))
      .map((v) => Math.abs(v!)),
    0,
  )
  const { factor, unit } = displayUnit(trace.unit, largest)
  // A long name is cut off before the entry, which distinguishes the rows of a vector.
  const twoParts = hasEntry(trace)
  return (
    <tr>
      <th scope="row" title={trace.label}>
        <span className="measured-trace">
          <i style={{ background: `var(--${trace.tone})` }} />
          <span className="name">{twoParts ? trace.stem : trace.label}</span>
          {twoParts && <span>&nbsp;{trace.entry}</span>}
          {unit && <span className="unit">&nbsp;{unit}</span>}
        </span>
      </th>
      {(cursors ? [a, b, b - a] : [a]).map((value, k) => (
        <td key={k} data-label={cursors ? 'ABΔ'[k] : `at ${formatNumber(now, 4)} s`}>
          {formatNumber(value * factor)}
        </td>
      ))}
      {measured &&
        ROWS.map(([name, head]) => (
          <td key={name} data-label={head}>
            {measureText(measured, name, factor)}
          </td>
        ))}
    </tr>
  )
}

/** A formatted measure; a dash if it is undefined. */
function measureText(measured: Measures, name: keyof Measures, factor: number): string {
  const value = measured[name]
  if (name === 'riseTime') return Number.isNaN(value) ? '–' : withUnit(value, 's')
  if (name === 'overshoot') return Number.isNaN(value) ? '–' : `${formatNumber(100 * value, 3)} %`
  return formatNumber(value * factor)
}
