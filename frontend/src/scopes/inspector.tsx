import '../mantine_later.css'
import { ActionIcon, Checkbox, NativeSelect, TextInput, Tooltip } from '@mantine/core'
import { IconSearch, IconTrash } from '@tabler/icons-react'
import { useEffect, useMemo, useState } from 'react'
import { create } from 'zustand'
import { valueText } from '../inspector/value_text'
import { useRuns, type StoredRun } from '../run/runs'
import { useStudio } from '../store'
import { Chart, useChartState } from './chart'
import { difference, largestDifference } from '../model/difference'
import { withUnit } from './quantity'
import { Grid, PlotTools } from './scopes'
import { DASHES, MAX_TRACES, sameTones, tracesOf, withEntry, type Trace } from '../model/trace'

/** Runs in one plot, the difference of two runs, or two plots with equal axes. */
type View = 'overlay' | 'difference' | 'side by side'

const VIEWS = [
  { value: 'overlay', label: 'Overlay' },
  { value: 'difference', label: 'Difference' },
  { value: 'side by side', label: 'Side by side' },
]

interface InspectorState {
  signals: ReadonlySet<string>
  /** Hidden runs; new runs are visible. */
  hidden: ReadonlySet<string>
  search: string
  view: View
  baseline: string
  compared: string
  tolerance: number
}

export const useInspectorState = create<InspectorState>(() => ({
  signals: new Set(),
  hidden: new Set(),
  search: '',
  view: 'overlay',
  baseline: '',
  compared: '',
  tolerance: 1e-6,
}))

function toggled(set: ReadonlySet<string>, key: string): Set<string> {
  const next = new Set(set)
  if (!next.delete(key)) next.add(key)
  return next
}

/** All runs and their signals; several signals in one plot, or two runs compared. */
export function SignalInspector() {
  const document = useStudio((s) => s.document?.state.document)
  const all = useRuns((s) => s.runs)
  const runs = useMemo(() => all.filter((run) => run.document === document), [all, document])
  if (!runs.length)
    return (
      <p className="empty">
        All runs are listed here for inspection and comparison. Run the model (Ctrl+Enter).
      </p>
    )
  return (
    <div className="signal-inspector">
      <PlotTools />
      <RunList runs={runs} />
      <SignalList runs={runs} />
      <InspectorPlot runs={runs} />
    </div>
  )
}

/** Values of a run that differ from the model: tried values at the start, or tuned values. */
function changesOf({ trialValues, tunings }: StoredRun): string[] {
  return [
    ...Object.entries(trialValues).map(([parameter, value]) => `${parameter} = ${valueText(value)}`),
    ...tunings
      .slice(-3)
      .map(
        ({ parameter, value, time }) => `${parameter} = ${valueText(value)} from ${time.toPrecision(3)} s`,
      ),
  ]
}

function RunList({ runs }: { runs: StoredRun[] }) {
  const hidden = useInspectorState((s) => s.hidden)
  const view = useInspectorState((s) => s.view)
  const displayedRun = useStudio((s) => s.run?.run)
  const { rename, remove } = useRuns.getState()
  return (
    <div className="run-list" role="group" aria-label="Runs">
      <header>
        Runs
        {runs.length > 1 && (
          <NativeSelect
            size="xs"
            w={112}
            aria-label="View"
            data={VIEWS}
            value={view}
            onChange={(event) => useInspectorState.setState({ view: event.currentTarget.value as View })}
          />
        )}
      </header>
      {view !== 'overlay' && runs.length > 1 && <Comparison runs={runs} />}
      {[...runs].reverse().map((run) => (
        <div key={run.key} className="stored-run">
          <Checkbox
            size="xs"
            aria-label={`Show ${run.name}`}
            checked={!hidden.has(run.key)}
            onChange={() => useInspectorState.setState((s) => ({ hidden: toggled(s.hidden, run.key) }))}
          />
          <div className="about">
            <RunName run={run} onName={(name) => rename(run.key, name)} />
            <small>
              {run.began.toLocaleTimeString()}, {run.state}
            </small>
            {changesOf(run).map((text) => (
              <small key={text} className="numbers changes" title={text}>
                {text}
              </small>
            ))}
          </div>
          {run.key !== displayedRun && (
            <Tooltip label="Delete this run">
              <ActionIcon
                size="xs"
                variant="subtle"
                color="gray"
                aria-label={`Delete ${run.name}`}
                onClick={() => remove(run.key)}
              >
                <IconTrash size={13} />
              </ActionIcon>
            </Tooltip>
          )}
        </div>
      ))}
    </div>
  )
}

function RunName({ run, onName }: { run: StoredRun; onName: (name: string) => void }) {
  const [typed, setTyped] = useState(run.name)
  const done = () => (typed.trim() ? onName(typed.trim()) : setTyped(run.name))
  return (
    <input
      className="run-name"
      aria-label={`Name of ${run.name}`}
      value={typed}
      onChange={(event) => setTyped(event.target.value)}
      onBlur={done}
      onKeyDown={(event) => event.key === 'Enter' && event.currentTarget.blur()}
    />
  )
}

/** The two compared runs: the last two by default. */
function comparedRuns(runs: StoredRun[], baseline: string, compared: string): [StoredRun, StoredRun] {
  const find = (key: string) => runs.find((run) => run.key === key)
  return [find(baseline) ?? runs.at(-2)!, find(compared) ?? runs.at(-1)!]
}

function Comparison({ runs }: { runs: StoredRun[] }) {
  const { baseline, compared, tolerance, view } = useInspectorState()
  const [a, b] = comparedRuns(runs, baseline, compared)
  const [typed, setTyped] = useState(String(tolerance))
  const data = runs.map(({ key, name }) => ({ value: key, label: name }))
  const invalid = !(Number(typed) >= 0) || !typed.trim()
  return (
    <div className="comparison">
      <NativeSelect
        size="xs"
        label="Baseline"
        data={data}
        value={a.key}
        onChange={(event) => useInspectorState.setState({ baseline: event.currentTarget.value })}
      />
      <NativeSelect
        size="xs"
        label="Compared"
        data={data}
        value={b.key}
        onChange={(event) => useInspectorState.setState({ compared: event.currentTarget.value })}
      />
      {view === 'difference' && (
        <TextInput
          size="xs"
          label="Tolerance"
          classNames={{ input: 'typed' }}
          value={typed}
          error={invalid && 'a number, 0 or more'}
          onChange={(event) => {
            const text = event.currentTarget.value
            setTyped(text)
            if (text.trim() && Number(text) >= 0) useInspectorState.setState({ tolerance: Number(text) })
          }}
        />
      )}
    </div>
  )
}

function SignalList({ runs }: { runs: StoredRun[] }) {
  const { signals, search, view, baseline, compared, tolerance } = useInspectorState()
  const comparing = view === 'difference'
  const names = useMemo(() => [...new Set(runs.flatMap(({ samples }) => samples.names))].sort(), [runs])
  const matches = names.filter((name) => name.toLowerCase().includes(search.toLowerCase()))
  const [a, b] = comparing && runs.length > 1 ? comparedRuns(runs, baseline, compared) : []
  return (
    <div className="signal-list">
      <TextInput
        size="xs"
        aria-label="Search the signals"
        placeholder="Search signals"
        leftSection={<IconSearch size={13} />}
        value={search}
        onChange={(event) => useInspectorState.setState({ search: event.currentTarget.value })}
      />
      <div className="signals" role="group" aria-label="Signals">
        {matches.map((name) => {
          const difference = a && b && largestDifference(a.samples, b.samples, name)
          const unit = a?.samples.signal(name)?.channel.unit ?? ''
          return (
            <label
              key={name}
              title={
                difference &&
                `maximum difference ${withUnit(difference.largest, unit)} at ${withUnit(difference.at, 's')}`
              }
            >
              <input
                type="checkbox"
                checked={signals.has(name)}
                onChange={() => useInspectorState.setState((s) => ({ signals: toggled(s.signals, name) }))}
              />
              <span className="listed-signal" title={runs.at(-1)!.samples.title(name)}>
                {runs.at(-1)!.samples.title(name)}
              </span>
              {difference && (
                <span
                  className={
                    difference.largest <= tolerance ? 'deviation numbers' : 'deviation exceeded numbers'
                  }
                >
                  {difference.largest <= tolerance ? '✓' : '✗'} {withUnit(difference.largest, unit, 3)}
                  {' at '}
                  {withUnit(difference.at, 's', 3)}
                </span>
              )}
            </label>
          )
        })}
        {!matches.length && <p className="empty">No signal has this name.</p>}
      </div>
    </div>
  )
}

function InspectorPlot({ runs }: { runs: StoredRun[] }) {
  const { signals, hidden, view, baseline, compared, tolerance } = useInspectorState()
  const comparing = view === 'difference' && runs.length > 1
  const paths = useMemo(() => [...signals].map((path) => ({ path, label: '' })), [signals])
  // Initially the inspector shows the first signal.
  useEffect(() => {
    const first = runs.at(-1)?.views.find(({ kind }) => kind === 'traces')
    const path = first && runs.at(-1)?.samples.signal(`${first.block}/${first.signals[0]}`)?.channel.name
    if (!useInspectorState.getState().signals.size && path)
      useInspectorState.setState({ signals: new Set([path]) })
  }, [runs])
  const traces = useMemo((): Trace[] => {
    if (comparing) {
      const [a, b] = comparedRuns(runs, baseline, compared)
      return tracesOf(a.samples, paths).map((trace) => {
        const separator = trace.key.lastIndexOf(' ')
        const [path, element] = [trace.key.slice(0, separator), Number(trace.key.slice(separator + 1))]
        return {
          ...trace,
          key: `${a.key} ${b.key} ${trace.key}`,
          channel: '', // a difference has no trigger level
          label: `Δ ${trace.label}`,
          read: () => difference(a.samples, b.samples, path, element),
        }
      })
    }
    const visibleRuns = runs.filter(({ key }) => !hidden.has(key))
    const hasOneTraceEach =
      visibleRuns.length > 1 && visibleRuns.every(({ samples }) => tracesOf(samples, paths).length === 1)
    return visibleRuns
      .flatMap((run, k) =>
        tracesOf(run.samples, paths).map((trace) => ({
          ...trace,
          key: `${run.key} ${trace.key}`,
          ...(visibleRuns.length > 1 ? withEntry(trace, [trace.entry, run.name]) : {}),
          tone: hasOneTraceEach ? `trace-${k % 8}` : trace.tone,
          dash:
            visibleRuns.length > 1 && !hasOneTraceEach
              ? DASHES[(visibleRuns.length - 1 - k) % DASHES.length]!
              : trace.dash,
        })),
      )
      .slice(0, MAX_TRACES)
  }, [runs, hidden, paths, comparing, baseline, compared])
  if (!signals.size) return <p className="empty">Select the signals to be shown.</p>
  if (view === 'side by side' && runs.length > 1)
    return <SideBySide runs={comparedRuns(runs, baseline, compared)} paths={paths} />
  return (
    <Grid count={1}>
      <Chart
        title={comparing ? 'Difference' : 'Signals'}
        traces={traces}
        {...(comparing ? { band: tolerance } : {})}
      />
    </Grid>
  )
}

/** Smallest width of one of two charts with measures beside each other, px. */
const MIN_MEASURED_WIDTH = 280

/** Two runs in two charts with the same axes, hidden traces, cursors and colours. */
function SideBySide({
  runs: [a, b],
  paths,
}: {
  runs: [StoredRun, StoredRun]
  paths: { path: string; label: string }[]
}) {
  const shared = useChartState()
  const [left, right] = useMemo(
    () => sameTones(tracesOf(a.samples, paths), tracesOf(b.samples, paths)),
    [a.samples, b.samples, paths],
  )
  const chart = (run: StoredRun, traces: Trace[], companions: Trace[]) =>
    traces.length ? (
      <Chart
        key={`${a.key} ${b.key} ${run.key}`}
        title={run.name}
        traces={traces}
        shared={shared}
        companions={companions}
      />
    ) : (
      <figure className="chart">
        <figcaption>
          <b>{run.name}</b>
        </figcaption>
        <p className="empty">This run has none of these signals.</p>
      </figure>
    )
  return (
    <Grid count={2} measuredWidth={MIN_MEASURED_WIDTH}>
      {chart(a, left, right)}
      {chart(b, right, left)}
    </Grid>
  )
}
