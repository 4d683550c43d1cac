import { create } from 'zustand'
import { scheduleFrame } from '../frames'
import type { EventOf } from '../messages'
import type { SinkView } from '../protocol'
import { RunSamples } from '../model/run_samples'
import { samples, showSamples } from '../samples'

/** A parameter that was changed during a run. */
export interface Tuning {
  time: number
  parameter: string
  value: unknown
}

/** A stored run: its samples, and the values that differed from the model. */
export interface StoredRun {
  key: string
  document: string
  name: string
  began: Date
  stopTime: number
  /** Number of samples that are reduced to their extremes; 1: no reduction. */
  stride: number
  state: string
  solver: string
  reason: string
  samples: RunSamples
  views: SinkView[]
  /** Tried values at the start. */
  trialValues: Record<string, unknown>
  tunings: Tuning[]
}

const MAX_RUNS = 50
const MAX_BYTES = 384 * 2 ** 20

interface Runs {
  runs: StoredRun[]
  /**
   * Tried values of tunable parameters by `block.parameter`; they are not saved in the model.
   */
  trialValues: Record<string, unknown>
  /** Simulated seconds per second of clock time; null: as fast as possible. */
  speed: number | null
  rename: (key: string, name: string) => void
  remove: (key: string) => void
}

/** All runs of this tab, latest last; the oldest are removed if there are too many. */
export const useRuns = create<Runs>((set) => ({
  runs: [],
  trialValues: {},
  speed: null,
  rename: (key, name) =>
    set((s) => ({ runs: s.runs.map((run) => (run.key === key ? { ...run, name } : run)) })),
  remove: (key) => set((s) => ({ runs: s.runs.filter((run) => run.key !== key || run.samples === samples) })),
}))
useRuns.subscribe(scheduleFrame)

let runCount = 0

function update(key: string, change: (run: StoredRun) => Partial<StoredRun>): void {
  useRuns.setState((s) => ({
    runs: s.runs.map((run) => (run.key === key ? { ...run, ...change(run) } : run)),
  }))
}

/** Store a run that has started. `displayed`: whether the client shows its diagram. */
export function onRunStarted(event: EventOf<'run_started'>, displayed: boolean): void {
  const stored = useRuns.getState().runs.find(({ key }) => key === event.run)
  if (stored) {
    // After a reconnection the server sends its run again from the beginning.
    stored.samples.truncate(0)
    restoreSignalNames(event)
    if (displayed) showSamples(stored.samples)
    update(event.run, () => ({ state: 'running', tunings: [] }))
    return
  }
  const runSamples = new RunSamples(event.run, event.channels, event.aliases)
  if (displayed) showSamples(runSamples)
  useRuns.setState((s) => {
    const run: StoredRun = {
      key: event.run,
      document: event.document,
      name: `Run ${++runCount}`,
      began: new Date(),
      stopTime: event.stop_time,
      stride: event.stride,
      state: 'running',
      solver: '',
      reason: '',
      samples: runSamples,
      views: event.views,
      trialValues: displayed ? { ...s.trialValues } : {},
      tunings: [],
    }
    const runs = [...s.runs, run].slice(-MAX_RUNS)
    const bytes = () => runs.reduce((sum, { samples }) => sum + samples.bytes, 0)
    while (runs.length > 1 && bytes() > MAX_BYTES) runs.shift()
    return { runs }
  })
}

/** Give the signals of a run the names that they had at its start. */
export function restoreSignalNames({ run, channels, aliases, views }: EventOf<'run_started'>): void {
  const stored = useRuns.getState().runs.find(({ key }) => key === run)
  stored?.samples.name(channels, aliases)
  update(run, () => ({ views }))
}

export function onRunTuned({ run, time, parameter, value }: EventOf<'run_tuned'>): void {
  update(run, ({ tunings }) => ({ tunings: [...tunings, { time, parameter, value }] }))
}

export function onRunRewound({ run, time, count }: EventOf<'run_rewound'>): void {
  useRuns
    .getState()
    .runs.find(({ key }) => key === run)
    ?.samples.truncate(count)
  scheduleFrame()
  // Values tuned later apply from the time to which the run has returned.
  update(run, ({ tunings }) => ({
    tunings: tunings.map((tuning) => ({ ...tuning, time: Math.min(tuning.time, time) })),
  }))
}

export function onRunProgress({ run, state, solver, reason }: EventOf<'run_progress'>): void {
  const stored = useRuns.getState().runs.find(({ key }) => key === run)
  if (!stored || stored.state === state) return
  if (state === 'done' || state === 'stopped' || state === 'failed') stored.samples.close()
  update(run, () => ({ state, solver, reason }))
}

/** Add a frame to the samples of its run: the displayed one, or one of a document in another tab. */
export function receiveFrame(frame: ArrayBuffer): void {
  if (samples.receive(frame)) return
  for (const run of useRuns.getState().runs)
    if ((run.state === 'running' || run.state === 'paused') && run.samples.receive(frame)) return
}
