import { create } from 'zustand'
import { changed } from '../frames'
import type { EventOf } from '../messages'
import type { ViewOf } from '../protocol'
import { RunSamples } from '../model/run_samples'
import { samples, showSamples } from '../samples'

/** A parameter that was changed during a run. */
export interface Tuning {
  time: number
  parameter: string
  value: unknown
}

/** A stored run: its samples, and the values that differed from the model. */
export interface KeptRun {
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
  views: ViewOf[]
  /** Trial values at the start. */
  tried: Record<string, unknown>
  tunings: Tuning[]
}

const MOST_RUNS = 50
const MOST_BYTES = 384 * 2 ** 20

interface Runs {
  runs: KeptRun[]
  /**
   * Trial values of tunable parameters by `block.parameter`; they are not in the model until they are kept.
   */
  tried: Record<string, unknown>
  /** Simulated seconds per second of clock time; null: as fast as possible. */
  speed: number | null
  rename: (key: string, name: string) => void
  remove: (key: string) => void
}

/** All runs since the page was opened, latest last; the oldest are dropped if there are too many. */
export const useRuns = create<Runs>((set) => ({
  runs: [],
  tried: {},
  speed: null,
  rename: (key, name) =>
    set((s) => ({ runs: s.runs.map((run) => (run.key === key ? { ...run, name } : run)) })),
  remove: (key) => set((s) => ({ runs: s.runs.filter((run) => run.key !== key || run.samples === samples) })),
}))
useRuns.subscribe(changed)

let counted = 0

function update(key: string, change: (run: KeptRun) => Partial<KeptRun>): void {
  useRuns.setState((s) => ({
    runs: s.runs.map((run) => (run.key === key ? { ...run, ...change(run) } : run)),
  }))
}

export function began(event: EventOf<'run_started'>): void {
  const known = useRuns.getState().runs.find(({ key }) => key === event.run)
  if (known) {
    // After a reconnection the server sends its run again from the beginning.
    known.samples.truncate(0)
    showSamples(known.samples)
    update(event.run, () => ({ state: 'running', tunings: [] }))
    return
  }
  const made = new RunSamples(event.run, event.channels, event.aliases)
  showSamples(made)
  useRuns.setState((s) => {
    const run: KeptRun = {
      key: event.run,
      document: event.document,
      name: `Run ${++counted}`,
      began: new Date(),
      stopTime: event.stop_time,
      stride: event.stride,
      state: 'running',
      solver: '',
      reason: '',
      samples: made,
      views: event.views,
      tried: { ...s.tried },
      tunings: [],
    }
    const runs = [...s.runs, run].slice(-MOST_RUNS)
    const bytes = () => runs.reduce((sum, { samples }) => sum + samples.bytes, 0)
    while (runs.length > 1 && bytes() > MOST_BYTES) runs.shift()
    return { runs }
  })
}

export function tuned({ run, time, parameter, value }: EventOf<'run_tuned'>): void {
  update(run, ({ tunings }) => ({ tunings: [...tunings, { time, parameter, value }] }))
}

export function rewound({ run, time, count }: EventOf<'run_rewound'>): void {
  if (samples.run === run) samples.truncate(count)
  changed()
  // Values tuned later apply from the time to which the run has returned.
  update(run, ({ tunings }) => ({
    tunings: tunings.map((one) => ({ ...one, time: Math.min(one.time, time) })),
  }))
}

export function progressed({ run, state, solver, reason }: EventOf<'run_progress'>): void {
  const known = useRuns.getState().runs.find(({ key }) => key === run)
  if (!known || known.state === state) return
  if (state === 'done' || state === 'stopped' || state === 'failed') known.samples.close()
  update(run, () => ({ state, solver, reason }))
}

/** Another document is shown: trial values and runs of the previous one are dropped. */
export function forget(): void {
  showSamples(new RunSamples('', [], {}))
  useRuns.setState({ tried: {} })
}
