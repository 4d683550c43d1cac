import { describe, expect, it } from 'vitest'
import {
  activeSet,
  changedTrials,
  refusalReason,
  sameValues,
  setNames,
  setRows,
} from '../../src/model/parameter_sets'
import type { ParameterSetTable } from '../../src/protocol'

const parameter = (path: string, value: unknown, tunable = true) => ({
  path,
  value,
  tunable,
  unit: '',
  doc: '',
})

const TABLE: ParameterSetTable = {
  parameters: [parameter('pid.kp', 5), parameter('pid.ki', 1), parameter('delay.steps', 2, false)],
  sets: {
    'set 10': { 'pid.kp': 9 },
    'set 2': { 'pid.kp': 5, 'pid.ki': 3 },
    steps: { 'pid.kp': 9, 'delay.steps': 4 },
    empty: {},
    stale: { 'pid.kp': 1, 'pid.kd': 2 },
  },
  faults: { stale: { 'pid.kd': 'there is no parameter named kd' } },
}

describe('parameter sets', () => {
  it('are listed in natural order', () => {
    expect(setNames(TABLE)).toEqual(['empty', 'set 2', 'set 10', 'stale', 'steps'])
  })

  it('are compared by all their values', () => {
    expect(sameValues({ a: [1, 2] }, { a: [1, 2] })).toBe(true)
    expect(sameValues({ a: 1 }, { a: 1, b: 2 })).toBe(false)
    expect(sameValues({ a: 1, b: 2 }, { a: 1, c: 2 })).toBe(false)
    expect(activeSet(TABLE, { 'pid.ki': 3, 'pid.kp': 5 })).toBe('set 2')
    expect(activeSet(TABLE, { 'pid.ki': 3 })).toBeUndefined()
    // Without trial values the model itself is active, not a set without values.
    expect(activeSet(TABLE, {})).toBeUndefined()
  })

  it('have the value of the model where they do not contain a parameter', () => {
    const [kp, ki, steps] = setRows(TABLE, ['set 10', 'set 2'])
    expect(kp!.cells.map(({ value, inherited, differs }) => [value, inherited, differs])).toEqual([
      [9, false, true],
      [5, false, false],
    ])
    expect(ki!.cells.map(({ value, inherited }) => [value, inherited])).toEqual([
      [1, true],
      [3, false],
    ])
    expect([kp!.varies, ki!.varies, steps!.varies]).toEqual([true, true, false])
  })

  it('name the reason for which they cannot be applied', () => {
    expect(refusalReason(TABLE, 'set 2', true)).toBeUndefined()
    expect(refusalReason(TABLE, 'stale', false)).toContain('pid.kd')
    expect(refusalReason(TABLE, 'steps', true)).toContain('delay.steps')
    expect(refusalReason(TABLE, 'steps', false)).toBeUndefined()
    expect(refusalReason(TABLE, 'empty', false)).toContain('no values')
  })

  it('replace the trial values of a run in progress', () => {
    const model: Record<string, unknown> = { a: 1, b: 2, c: 3 }
    const changed = (before: Record<string, unknown>, next: Record<string, unknown>) =>
      changedTrials(before, next, (path) => model[path])
    expect(changed({ a: 9, b: 8 }, { b: 8, c: 7 })).toEqual({ a: 1, c: 7 })
    expect(changed({}, { a: 5 })).toEqual({ a: 5 })
    expect(changed({ a: 5 }, {})).toEqual({ a: 1 })
    expect(changed({ gone: 5 }, {})).toEqual({})
  })
})
