import { expect, test } from 'vitest'
import { fittedLabel, tickText } from '../../src/model/axis_texts'
import { ticks } from '../../src/scopes/figure'

test('a label is cut off before its unit', () => {
  expect(fittedLabel('speed, rad/s', 200)).toBe('speed, rad/s')
  expect(fittedLabel('speed of the first joint, rad/s', 90)).toBe('speed o…, rad/s')
  expect(fittedLabel('speed of the first joint, rad/s', 50)).toBe('rad/s')
  expect(fittedLabel('speed of the first joint', 60)).toBe('speed of…')
})

test('ticks that differ have different texts', () => {
  expect([-2, 0, 0.5].map((value) => tickText(value, 0.5))).toEqual(['−2.0', '0.0', '0.5'])
  expect([-2.5e-7, 0, 5e-7].map((value) => tickText(value, 2.5e-7))).toEqual(['−2.5e−7', '0', '5e−7'])
  expect([1, 1 + 2e-7].map((value) => tickText(value, 2e-7))).toEqual(['1e0', '1.0000002e0'])
  expect([2e6, 2.05e6].map((value) => tickText(value, 5e4))).toEqual(['2e6', '2.05e6'])
})

test('an axis has at least two ticks', () => {
  expect(ticks(-2.7, 2.7, 2)).toEqual([-2.5, 0, 2.5])
  expect(ticks(-2.4, 2.4, 2)).toEqual([-2, 0, 2])
  expect(ticks(0, 10, 5)).toEqual([0, 2, 4, 6, 8, 10])
  for (let low = -3; low < 3; low += 0.17) expect(ticks(low, low + 1.9, 2).length).toBeGreaterThan(1)
})
