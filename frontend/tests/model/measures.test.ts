import { describe, expect, test } from 'vitest'
import { measures } from '../../src/model/measures'
import { valueAt } from '../../src/model/trace'

function trace(time: number[], value: (t: number) => number) {
  return { time: Float64Array.from(time), values: Float64Array.from(time, value) }
}
const even = (count: number, end: number) => Array.from({ length: count + 1 }, (_, k) => (end * k) / count)

describe('measures of a trace', () => {
  test('of a sine over whole periods', () => {
    const result = measures(
      trace(even(4000, 2), (t) => 1 + 3 * Math.sin(2 * Math.PI * t)),
      0,
      2,
    )
    expect(result.mean).toBeCloseTo(1, 9)
    expect(result.rms).toBeCloseTo(Math.sqrt(1 + 4.5), 5)
    expect(result.peakToPeak).toBeCloseTo(6, 9)
    expect([result.riseTime, result.overshoot], 'no final value').toEqual([NaN, NaN])
  })

  test('are weighted by time: uneven samples of a straight line do not change them', () => {
    const line = (t: number) => 2 * t
    const uneven = measures(trace([0, 0.1, 0.15, 3.9, 4], line), 0, 4)
    expect(uneven.mean).toBeCloseTo(4, 12)
    expect(uneven.rms).toBeCloseTo(8 / Math.sqrt(3), 12)
  })

  test('of a window that ends between samples', () => {
    const result = measures(
      trace([0, 1, 2, 3], (t) => t),
      0.5,
      2.25,
    )
    expect([result.minimum, result.maximum]).toEqual([0.5, 2.25])
    expect(result.mean).toBeCloseTo(1.375, 12)
  })

  test('rise time and overshoot of a step response', () => {
    const lag = measures(
      trace(even(40_000, 20), (t) => 1 - Math.exp(-t)),
      0,
      20,
    )
    expect(lag.riseTime, 'ln 9 time constants').toBeCloseTo(Math.log(9), 4)
    expect(lag.overshoot).toBe(0)
    const damping = 0.5
    const w = Math.sqrt(1 - damping ** 2)
    const second = (t: number) =>
      1 - Math.exp(-damping * t) * (Math.cos(w * t) + (damping / w) * Math.sin(w * t))
    expect(measures(trace(even(20_000, 30), second), 0, 30).overshoot).toBeCloseTo(
      Math.exp((-Math.PI * damping) / w),
      4,
    )
    const falling = measures(
      trace(even(40_000, 20), (t) => Math.exp(-t)),
      0,
      20,
    )
    expect(falling.riseTime).toBeCloseTo(Math.log(9), 4)
  })

  test('of an empty window are NaN', () => {
    expect(
      Object.values(
        measures(
          trace([0, 1], (t) => t),
          2,
          3,
        ),
      ).every(Number.isNaN),
    ).toBe(true)
    expect(
      measures(
        trace([5], () => 7),
        0,
        9,
      ),
    ).toMatchObject({ mean: 7, rms: 7, peakToPeak: 0 })
  })
})

test('the value at an instant is linearly interpolated', () => {
  const line = trace([0, 1, 3], (t) => t * t)
  expect([0, 0.5, 1, 2, 3].map((at) => valueAt(line, at))).toEqual([0, 0.5, 1, 5, 9])
  expect([-1, 3.5].map((at) => valueAt(line, at))).toEqual([NaN, NaN])
})
