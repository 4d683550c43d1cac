import '../mantine_later.css'
import { ActionIcon, Checkbox, NativeSelect, Switch, TextInput, Tooltip } from '@mantine/core'
import { IconSearch, IconTrash } from '@tabler/icons-react'
import { useEffect, useMemo, useState } from 'react'
import { create } from 'zustand'
import { valueText } from '../inspector/value_text'
import { useRuns, type KeptRun } from '../run/runs'
import { useStudio } from '../store'
import { Chart } from './chart'
import { difference, farthest } from '../model/difference'
import { spoken } from './quantity'
import { PlotTools } from './scopes'
import { DASHES, MOST_TRACES, tracesOf, type Trace } from '../model/trace'

interface Inspector {
  signals: ReadonlySet<string>
  /** Hidden runs; new runs are visible. */
  hidden: ReadonlySet<string>
  search: string
  comparing: boolean
  baseline: string
  compared: string
  tolerance: number
}

export const useInspector = create<Inspector>(() => ({
  signals: new Set(),
  hidden: new Set(),
  search: '',
  comparing: false,
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

/** Values of a run that differ from the model: trial values at the start, or tuned values. */
function changesOf({ tried, tunings }: KeptRun): string[] {
  return [
    ...Object.entries(tried).map(([parameter, value]) => `${parameter} = ${valueText(value)}`),
    ...tunings
      .slice(-3)
      .map(
        ({ parameter, value, time }) => `${parameter} = ${valueText(value)} from ${time.toPrecision(3)} s`,
      ),
  ]
}

function RunList({ runs }: { runs: KeptRun[] }) {
  const hidden = useInspector((s) => s.hidden)
  const comparing = useInspector((s) => s.comparing)
  const shown = useStudio((s) => s.run?.run)
  const { rename, remove } = useRuns.getState()
  return (
    <div className="run-list" role="group" aria-label="Runs">
      <header>
        Runs
        {runs.length > 1 && (
          <Switch
            size="xs"
            label="Difference"
            checked={comparing}
            onChange={() => useInspector.setState((s) => ({ comparing: !s.comparing }))}
          />
        )}
      </header>
      {comparing && runs.length > 1 && <Comparison runs={runs} />}
      {[...runs].reverse().map((run) => (
        <div key={run.key} className="kept-run">
          <Checkbox
            size="xs"
            aria-label={`Show ${run.name}`}
            checked={!hidden.has(run.key)}
            onChange={() => useInspector.setState((s) => ({ hidden: toggled(s.hidden, run.key) }))}
          />
          <div className="about">
            <RunName run={run} onName={(name) => rename(run.key, name)} />
            <small>
              {run.began.toLocaleTimeString()}, {run.state}
            </small>
            {changesOf(run).map((text) => (
              <small key={text} className="numbers changes">
                {text}
              </small>
            ))}
          </div>
          {run.key !== shown && (
            <Tooltip label="Delete this run">
              <ActionIcon
                size="xs"
                variant="subtle"
                color="gray"
                aria-label={`Forget ${run.name}`}
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

function RunName({ run, onName }: { run: KeptRun; onName: (name: string) => void }) {
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
function pair(runs: KeptRun[], baseline: string, compared: string): [KeptRun, KeptRun] {
  const find = (key: string) => runs.find((run) => run.key === key)
  return [find(baseline) ?? runs.at(-2)!, find(compared) ?? runs.at(-1)!]
}

function Comparison({ runs }: { runs: KeptRun[] }) {
  const { baseline, compared, tolerance } = useInspector()
  const [a, b] = pair(runs, baseline, compared)
  const [typed, setTyped] = useState(String(tolerance))
  const data = runs.map(({ key, name }) => ({ value: key, label: name }))
  const wrong = !(Number(typed) >= 0) || !typed.trim()
  return (
    <div className="comparison">
      <NativeSelect
        size="xs"
        label="Baseline"
        data={data}
        value={a.key}
        onChange={(event) => useInspector.setState({ baseline: event.currentTarget.value })}
      />
      <NativeSelect
        size="xs"
        label="Compared"
        data={data}
        value={b.key}
        onChange={(event) => useInspector.setState({ compared: event.currentTarget.value })}
      />
      <TextInput
        size="xs"
        label="Tolerance"
        classNames={{ input: 'typed' }}
        value={typed}
        error={wrong && 'a number, 0 or more'}
        onChange={(event) => {
          const text = event.currentTarget.value
          setTyped(text)
          if (text.trim() && Number(text) >= 0) useInspector.setState({ tolerance: Number(text) })
        }}
      />
    </div>
  )
}

function SignalList({ runs }: { runs: KeptRun[] }) {
  const { signals, search, comparing, baseline, compared, tolerance } = useInspector()
  const names = useMemo(() => [...new Set(runs.flatMap(({ samples }) => samples.names))].sort(), [runs])
  const found = names.filter((name) => name.toLowerCase().includes(search.toLowerCase()))
  const [a, b] = comparing && runs.length > 1 ? pair(runs, baseline, compared) : []
  return (
    <div className="signal-list">
      <TextInput
        size="xs"
        aria-label="Search the signals"
        placeholder="Search signals"
        leftSection={<IconSearch size={13} />}
        value={search}
        onChange={(event) => useInspector.setState({ search: event.currentTarget.value })}
      />
      <div className="signals" role="group" aria-label="Signals">
        {found.map((name) => {
          const apart = a && b && farthest(a.samples, b.samples, name)
          const unit = a?.samples.signal(name)?.channel.unit ?? ''
          return (
            <label
              key={name}
              title={
                apart && `greatest difference ${spoken(apart.largest, unit)} at ${spoken(apart.at, 's')}`
              }
            >
              <input
                type="checkbox"
                checked={signals.has(name)}
                onChange={() => useInspector.setState((s) => ({ signals: toggled(s.signals, name) }))}
              />
              <span className="signal-name">{runs.at(-1)!.samples.title(name)}</span>
              {apart && (
                <span className={apart.largest <= tolerance ? 'apart numbers' : 'apart beyond numbers'}>
                  {apart.largest <= tolerance ? '✓' : '✗'} {spoken(apart.largest, unit, 3)} at{' '}
                  {spoken(apart.at, 's', 3)}
                </span>
              )}
            </label>
          )
        })}
        {!found.length && <p className="empty">No signal has this name.</p>}
      </div>
    </div>
  )
}

function InspectorPlot({ runs }: { runs: KeptRun[] }) {
  const { signals, hidden, comparing, baseline, compared, tolerance } = useInspector()
  const paths = useMemo(() => [...signals].map((path) => ({ path, label: '' })), [signals])
  // Initially the inspector shows the first signal.
  useEffect(() => {
    const first = runs.at(-1)?.views.find(({ kind }) => kind === 'traces')
    const path = first && runs.at(-1)?.samples.signal(`${first.block}/${first.signals[0]}`)?.channel.name
    if (!useInspector.getState().signals.size && path) useInspector.setState({ signals: new Set([path]) })
  }, [runs])
  const traces = useMemo((): Trace[] => {
    if (comparing && runs.length > 1) {
      const [a, b] = pair(runs, baseline, compared)
      return tracesOf(a.samples, paths).map((trace) => {
        const at = trace.key.lastIndexOf(' ')
        const [path, element] = [trace.key.slice(0, at), Number(trace.key.slice(at + 1))]
        return {
          ...trace,
          key: `${a.key} ${b.key} ${trace.key}`,
          label: `Δ ${trace.label}`,
          read: () => difference(a.samples, b.samples, path, element),
        }
      })
    }
    const shown = runs.filter(({ key }) => !hidden.has(key))
    const single = shown.length > 1 && shown.every(({ samples }) => tracesOf(samples, paths).length === 1)
    return shown
      .flatMap((run, k) =>
        tracesOf(run.samples, paths).map((trace) => ({
          ...trace,
          key: `${run.key} ${trace.key}`,
          label: shown.length > 1 ? `${trace.label}, ${run.name}` : trace.label,
          tone: single ? `trace-${k % 8}` : trace.tone,
          dash: shown.length > 1 && !single ? DASHES[(shown.length - 1 - k) % DASHES.length]! : trace.dash,
        })),
      )
      .slice(0, MOST_TRACES)
  }, [runs, hidden, paths, comparing, baseline, compared])
  if (!signals.size) return <p className="empty">Tick the signals to be shown.</p>
  return (
    <div className="scopes">
      <Chart
        title={comparing ? 'Difference' : 'Signals'}
        traces={traces}
        {...(comparing ? { band: tolerance } : {})}
      />
    </div>
  )
}
