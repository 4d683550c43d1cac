import { expect, test } from 'vitest'
import { withGrowthMargin, withMargin } from '../../src/model/axis_range'

const { MAX_VALUE, MIN_VALUE } = Number

test('a range has a margin and is not empty', () => {
  expect(withMargin(0, 100)).toEqual([-6, 106])
  expect(withMargin(5, 5)).toEqual([4.5, 5.5])
  expect(withMargin(0, 0)).toEqual([-1, 1])
  expect(withMargin(Infinity, -Infinity)).toEqual([0, 1])
  expect(withMargin(NaN, 1)).toEqual([0, 1])
})

test('the length of a range and px per unit are finite for all values', () => {
  for (const [min, max] of [
    [-MAX_VALUE, MAX_VALUE],
    [MAX_VALUE, MAX_VALUE],
    [-Infinity, Infinity],
    [0, MIN_VALUE],
    [-MIN_VALUE, -MIN_VALUE],
    [0, 1e-320],
  ] as const) {
    const [low, high] = withGrowthMargin(withMargin(min, max), withMargin(0, 0))
    expect(high).toBeGreaterThan(low)
    expect(Number.isFinite(high - low)).toBe(true)
    expect(Number.isFinite(400 / (high - low))).toBe(true)
  }
})
