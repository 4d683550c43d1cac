import type { ScopeTriggerSettings } from '../protocol'

/** Directions in which a signal crosses the trigger level. */
export type Edge = 'rising' | 'falling' | 'either'

/**
 * The displayed window: `normal` shows the window of the last trigger, `auto` also the last samples while
 * there is no trigger, and `single` the first trigger after the scope was armed.
 */
export type Mode = 'normal' | 'auto' | 'single'

/** The settings of the trigger of a document; the signal is a channel of its runs and an element of it. */
export interface TriggerSettings {
  on: boolean
  channel: string
  element: number
  edge: Edge
  /** In the SI unit of the signal. */
  level: number
  mode: Mode
  /** Width of the window, s, and the part of it before the trigger. */
  span: number
  position: number
  /** Time after a trigger during which other triggers are ignored, s. */
  holdOff: number
}

export const INITIAL_TRIGGER: TriggerSettings = {
  on: false,
  channel: '',
  element: 0,
  edge: 'rising',
  level: 0,
  mode: 'normal',
  span: 1,
  position: 0.5,
  holdOff: 0,
}

/** The settings of a trigger, without other properties of the object. */
export function settingsOf(trigger: TriggerSettings): TriggerSettings {
  const { on, channel, element, edge, level, mode, span, position, holdOff } = trigger
  return { on, channel, element, edge, level, mode, span, position, holdOff }
}

/** Whether two triggers have the same settings. */
export const isSameTrigger = (one: TriggerSettings, other: TriggerSettings): boolean =>
  (Object.keys(INITIAL_TRIGGER) as (keyof TriggerSettings)[]).every((name) => one[name] === other[name])

/** The settings of the trigger of a diagram; a diagram without a trigger has the initial settings. */
export function fromMessage(message: ScopeTriggerSettings | null): TriggerSettings {
  if (!message) return INITIAL_TRIGGER
  const { signal: channel, hold_off: holdOff, ...others } = message
  return { ...others, channel, holdOff }
}

/** The trigger of a diagram with these settings. */
export function toMessage(settings: TriggerSettings): ScopeTriggerSettings | null {
  if (isSameTrigger(settings, INITIAL_TRIGGER)) return null
  const { channel: signal, holdOff: hold_off, ...others } = settingsOf(settings)
  return { ...others, signal, hold_off }
}

interface Samples {
  time: Float64Array
  values: Float64Array
}

/**
 * Times at which a trace crosses a level, found as its samples arrive.
 *
 * A rising crossing begins below the level and ends at or above it; a falling one begins above it and ends
 * at or below it. A trace that then remains at the level does not trigger again. Between samples the time is
 * interpolated linearly, as the trace is drawn; a jump, which has two samples of the same time, triggers
 * once at this time. After a crossing, other crossings are ignored for the hold-off time.
 */
export class TriggerDetector {
  /** The trigger times, ascending, s. */
  readonly times: number[] = []
  private examined = 0
  private armedToRise = false
  private armedToFall = false
  private lastTime = NaN
  private lastValue = NaN

  constructor(
    private readonly edge: Edge,
    private readonly level: number,
    private readonly holdOff: number,
  ) {}

  /** Examine the samples that were added to the trace since the last call. */
  update({ time, values }: Samples): void {
    for (; this.examined < values.length; this.examined++)
      this.examine(time[this.examined]!, values[this.examined]!)
  }

  private examine(time: number, value: number): void {
    const { level, edge, lastTime, lastValue } = this
    if (Number.isNaN(value)) {
      this.armedToRise = this.armedToFall = false
      this.lastValue = NaN
      return
    }
    const crosses = (this.armedToRise && value >= level) || (this.armedToFall && value <= level)
    const rises = this.armedToRise && value >= level
    if (crosses && (edge === 'either' || (edge === 'rising') === rises)) {
      const part = (level - lastValue) / (value - lastValue)
      // No time can be interpolated between infinite values: the crossing is at the second sample.
      const at = Number.isFinite(part) ? lastTime + part * (time - lastTime) : time
      if (!(at < (this.times.at(-1) ?? -Infinity) + this.holdOff)) this.times.push(at)
    }
    if (value < level) [this.armedToRise, this.armedToFall] = [true, false]
    else if (value > level) [this.armedToRise, this.armedToFall] = [false, true]
    else if (crosses) this.armedToRise = this.armedToFall = false
    this.lastTime = time
    this.lastValue = value
  }
}

/** The window about a trigger: `position` is the part of `span` (s) before it. */
export function triggerWindow(time: number, span: number, position: number): [number, number] {
  return [time - position * span, time + (1 - position) * span]
}

interface Choice {
  mode: Mode
  span: number
  position: number
  /** The earliest time of a trigger that `single` accepts, s. */
  armedAt: number
  /** Index of the trigger that the user has chosen; null: the last one. */
  chosen: number | null
  /** Whether the run continues, and the time of its last sample, s. */
  running: boolean
  end: number
}

/**
 * The index of the displayed trigger: the last one whose window is complete, so that the picture of a running
 * simulation changes once for each trigger. The first one is shown at once.
 */
export function shownTrigger(times: number[], choice: Choice): number | null {
  const { mode, span, position, armedAt, chosen, end } = choice
  if (mode === 'single') {
    const first = times.findIndex((time) => time >= armedAt)
    return first < 0 ? null : first
  }
  if (!times.length) return null
  if (chosen !== null) return Math.min(chosen, times.length - 1)
  let last = times.length - 1
  const isComplete = (index: number) => triggerWindow(times[index]!, span, position)[1] <= end
  while (last > 0 && !isComplete(last)) last--
  return last
}

/** The visible times; null if there is nothing to show, so that the last picture remains. */
export function shownTimes(times: number[], choice: Choice): [number, number] | null {
  const { mode, span, position, running, end, chosen } = choice
  const index = shownTrigger(times, choice)
  const window = index === null ? null : triggerWindow(times[index]!, span, position)
  if (mode !== 'auto' || !running || chosen !== null) return window
  // Without a trigger for the time of two windows, the last samples are shown.
  const isOverdue = end > (times.at(-1) ?? -Infinity) + 2 * span
  return window && !isOverdue ? window : [end - span, end]
}
