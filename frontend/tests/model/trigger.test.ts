import { describe, expect, it } from 'vitest'
import {
  fromMessage,
  INITIAL_TRIGGER,
  isSameTrigger,
  shownTimes,
  shownTrigger,
  toMessage,
  TriggerDetector,
  type Edge,
  type Mode,
} from '../../src/model/trigger'
import { seeded } from './random'

const trace = (...rows: [time: number, value: number][]) => ({
  time: Float64Array.from(rows, ([time]) => time),
  values: Float64Array.from(rows, ([, value]) => value),
})

function triggers(rows: [number, number][], edge: Edge, level = 0, holdOff = 0): number[] {
  const detector = new TriggerDetector(edge, level, holdOff)
  detector.update(trace(...rows))
  return detector.times
}

/** Rows at the times 0, 1, 2 … */
const sampled = (...values: number[]) => values.map((value, k): [number, number] => [k, value])

describe('the trigger of a scope', () => {
  it('finds crossings by linear interpolation', () => {
    const saw: [number, number][] = [0, 1, 2, 3, 4].map((k) => [k, k % 2 ? 3 : -1])
    expect(triggers(saw, 'rising')).toEqual([0.25, 2.25])
    expect(triggers(saw, 'falling')).toEqual([1.75, 3.75])
    expect(triggers(saw, 'either')).toEqual([0.25, 1.75, 2.25, 3.75])
    expect(triggers(saw, 'rising', 3)).toEqual([1, 3])
    expect(triggers(saw, 'rising', 3.1)).toEqual([])
  })

  it('has one trigger at a jump through the level, at the exact time', () => {
    const jumps: [number, number][] = [
      [0, -1],
      [2.003, -1],
      [2.003, 1],
      [4, 1],
      [4, -1],
      [5, -1],
    ]
    expect(triggers(jumps, 'rising')).toEqual([2.003])
    expect(triggers(jumps, 'falling')).toEqual([4])
    expect(triggers(jumps, 'either')).toEqual([2.003, 4])
    // A jump that begins or ends at the level.
    expect(triggers([...jumps.slice(0, 2), [2.003, 0], [3, 0], [3, 1]], 'either')).toEqual([2.003])
    expect(
      triggers(
        [
          [0, 0],
          [1, 0],
          [1, 1],
          [2, 1],
        ],
        'either',
      ),
    ).toEqual([])
  })
})

describe('a crossing of the trigger level', () => {
  it('triggers once where a trace touches the level or remains there', () => {
    expect(triggers(sampled(-1, 0, -1), 'either')).toEqual([1])
    expect(triggers(sampled(-1, 0, 0, 1), 'either')).toEqual([1])
    expect(triggers(sampled(-1, 0, 0, -1, 1), 'rising')).toEqual([1, 3.5])
    expect(triggers(sampled(1, 0, 0, 1), 'falling')).toEqual([1])
    expect(triggers(sampled(0, 1), 'rising')).toEqual([])
  })

  it('ignores crossings during the hold-off time, and gaps of the signal', () => {
    const saw: [number, number][] = [0, 1, 2, 3, 4, 5, 6].map((k) => [k, k % 2 ? 1 : -1])
    expect(triggers(saw, 'rising', 0, 2)).toEqual([0.5, 2.5, 4.5])
    expect(triggers(saw, 'rising', 0, 2.1)).toEqual([0.5, 4.5])
    expect(triggers(saw, 'rising', NaN)).toEqual([])
    expect(triggers(sampled(-1, NaN, 1, -1, 1), 'rising')).toEqual([3.5])
    expect(triggers(sampled(-Infinity, 1), 'rising')).toEqual([1])
  })
})

describe('the trigger of a growing trace', () => {
  it('has the same result whether samples arrive at once or one by one', () => {
    const chance = seeded(7)
    for (let round = 0; round < 200; round++) {
      const rows: [number, number][] = []
      for (let k = 0, time = 0; k < 40; k++) {
        if (chance() > 0.3) time += chance()
        if (rows.at(-1)?.[0] === time && rows.at(-2)?.[0] === time) time += 0.1
        rows.push([time, Math.round(4 * chance() - 2)])
      }
      const edge = (['rising', 'falling', 'either'] as const)[round % 3]!
      const live = new TriggerDetector(edge, 0, 0.5)
      rows.forEach((_, k) => live.update(trace(...rows.slice(0, k + 1))))
      expect(live.times).toEqual(triggers(rows, edge, 0, 0.5))
      expect(live.times.every((time, k) => !k || time - live.times[k - 1]! >= 0.5)).toBe(true)
    }
  })
})

describe('the window of a triggered scope', () => {
  const choice = (mode: Mode, others: object = {}) => ({
    mode,
    span: 1,
    position: 0.25,
    armedAt: -Infinity,
    chosen: null,
    running: true,
    end: 10,
    ...others,
  })

  it('is the last complete one, or the first one', () => {
    expect(shownTimes([2, 5, 9.5], choice('normal'))).toEqual([4.75, 5.75])
    expect(shownTimes([2, 5, 9.5], choice('normal', { running: false }))).toEqual([4.75, 5.75])
    expect(shownTimes([9.5], choice('normal'))).toEqual([9.25, 10.25])
    expect(shownTimes([], choice('normal'))).toBeNull()
    expect(shownTimes([2, 5, 9.5], choice('normal', { chosen: 0 }))).toEqual([1.75, 2.75])
    expect(shownTrigger([2], choice('normal', { chosen: 5 }))).toBe(0)
  })

  it('follows the last samples in auto mode while there is no trigger', () => {
    expect(shownTimes([], choice('auto'))).toEqual([9, 10])
    expect(shownTimes([2, 7.9], choice('auto'))).toEqual([9, 10])
    expect(shownTimes([2, 8.1], choice('auto'))).toEqual([7.85, 8.85])
    expect(shownTimes([2], choice('auto', { running: false }))).toEqual([1.75, 2.75])
  })

  it('is the first one after arming in single mode', () => {
    expect(shownTimes([2, 5, 9], choice('single'))).toEqual([1.75, 2.75])
    expect(shownTimes([2, 5, 9], choice('single', { armedAt: 4 }))).toEqual([4.75, 5.75])
    expect(shownTimes([2, 5, 9], choice('single', { armedAt: 9.5 }))).toBeNull()
  })
})

describe('the trigger of a diagram', () => {
  it('has the settings that were sent, without the displayed trigger', () => {
    const settings = { ...INITIAL_TRIGGER, on: true, channel: 'rne/tau', element: 2, level: -1.5, holdOff: 2 }
    const trigger = { ...settings, chosen: 3, armedAt: 1, count: 5, index: 3, at: 0.2 }
    expect(toMessage(trigger)).toEqual({
      on: true,
      signal: 'rne/tau',
      element: 2,
      edge: 'rising',
      level: -1.5,
      mode: 'normal',
      span: 1,
      position: 0.5,
      hold_off: 2,
    })
    expect(fromMessage(toMessage(trigger))).toEqual(settings)
    expect(isSameTrigger(settings, trigger)).toBe(true)
    expect(isSameTrigger(settings, { ...settings, holdOff: 0 })).toBe(false)
  })

  it('is not stored while all settings are the initial ones', () => {
    expect(toMessage({ ...INITIAL_TRIGGER })).toBeNull()
    expect(fromMessage(null)).toEqual(INITIAL_TRIGGER)
  })
})
