import { create } from 'zustand'
import { onFrame, scheduleFrame } from '../frames'
import {
  INITIAL_TRIGGER,
  shownTimes,
  shownTrigger,
  TriggerDetector,
  type TriggerSettings,
} from '../model/trigger'
import { samples } from '../samples'
import { useStudio } from '../store'
import { useWindow, wholeRun } from './window'

interface Trigger extends TriggerSettings {
  /** The trigger that the user has chosen; null: the last trigger. */
  chosen: number | null
  /** The time from which on a single trigger is accepted, s. */
  armedAt: number
  /** The number of triggers, the displayed trigger, and its time, s. */
  count: number
  index: number | null
  at: number | null
}

/** The trigger of all time plots: they show the window about a crossing of a level. */
export const useTrigger = create<Trigger>(() => ({
  ...INITIAL_TRIGGER,
  chosen: null,
  armedAt: -Infinity,
  count: 0,
  index: null,
  at: null,
}))
useTrigger.subscribe(scheduleFrame)

let detector: TriggerDetector | null = null
let detectorKey = ''
let runOfTrigger = ''
let lastWindow = ''

/** Use other settings, without a chosen trigger. */
export function applySettings(settings: TriggerSettings): void {
  lastWindow = ''
  useTrigger.setState({ ...settings, chosen: null, armedAt: -Infinity, count: 0, index: null, at: null })
}

/** Find the triggers of new samples, and show the window about the chosen trigger. */
function updateTrigger(): void {
  const state = useTrigger.getState()
  if (!state.on) return
  const { channel, element, edge, level, holdOff } = state
  if (samples.run !== runOfTrigger) {
    runOfTrigger = samples.run
    useTrigger.setState({ chosen: null, armedAt: -Infinity })
  }
  const key = [samples.run, samples.stepBacks, channel, element, edge, level, holdOff].join(' ')
  if (!detector || key !== detectorKey) {
    detector = new TriggerDetector(edge, level, holdOff)
    detectorKey = key
  }
  const signal = samples.signal(channel)
  const values = signal?.columns[element]
  if (signal && values) detector.update({ time: signal.time, values })
  const { times } = detector
  const runState = useStudio.getState().run?.state
  const choice = {
    ...useTrigger.getState(),
    running: runState === 'running' || runState === 'paused',
    end: samples.time[samples.count - 1] ?? 0,
  }
  const index = shownTrigger(times, choice)
  const at = index === null ? null : times[index]!
  if (state.count !== times.length || state.index !== index || state.at !== at)
    useTrigger.setState({ count: times.length, index, at })
  const range = shownTimes(times, choice)
  if (range && String(range) !== lastWindow) useWindow.setState({ range })
  lastWindow = String(range)
}
onFrame(updateTrigger)

/** The signal of the first trace, its mean level, and a tenth of the run as the window. */
function initialSettings(): Partial<Trigger> {
  const view = useStudio.getState().run?.views.find(({ kind }) => kind === 'traces')
  const signal = samples.signal(view ? `${view.block}/${view.signals[0]}` : (samples.names[0] ?? ''))
  if (!signal) return {}
  const finite = (signal.columns[0] ?? new Float64Array(0)).filter(Number.isFinite)
  const low = finite.reduce((least, value) => Math.min(least, value), Infinity)
  const high = finite.reduce((greatest, value) => Math.max(greatest, value), -Infinity)
  const [from, to] = wholeRun()
  const level = finite.length ? Number(((low + high) / 2).toPrecision(2)) : 0
  return {
    channel: signal.channel.name,
    element: 0,
    level: Math.abs(level) < 1e-9 * (high - low) ? 0 : level,
    span: Number(((to - from) / 10).toPrecision(2)) || 1,
  }
}

/** Switch the trigger on or off; without a trigger the whole run is shown. */
export function toggleTrigger(): void {
  const { on, channel } = useTrigger.getState()
  lastWindow = ''
  if (on) useWindow.setState({ range: null })
  const known = samples.names.includes(channel)
  useTrigger.setState({ on: !on, chosen: null, ...(on || known ? {} : initialSettings()) })
}

/** Show an earlier or later trigger. */
export function stepTrigger(steps: number): void {
  const { index, count } = useTrigger.getState()
  if (index === null) return
  lastWindow = ''
  useTrigger.setState({ chosen: Math.min(Math.max(index + steps, 0), count - 1) })
}

/** Follow the last trigger again; a single trigger is awaited from the present time on. */
export function armTrigger(): void {
  useTrigger.setState({ chosen: null, armedAt: samples.time[samples.count - 1] ?? 0 })
}
