import { expect, test } from 'vitest'
import { difference } from '../../src/model/difference'
import { measures } from '../../src/model/measures'
import { RunSamples } from '../../src/model/run_samples'
import { withCommonTimes, valueAt, valueBefore } from '../../src/model/trace'

const trace = (...rows: [number, number][]) => ({
  time: Float64Array.from(rows, ([t]) => t),
  values: Float64Array.from(rows, ([, v]) => v),
})
const step = trace([0, 0], [1, 0], [1.5, 0], [1.5, 4], [2, 4])

test('a jump has a left limit and a value', () => {
  expect([valueBefore(step, 1.5), valueAt(step, 1.5)]).toEqual([0, 4])
  expect([valueBefore(step, 1.25), valueAt(step, 1.75), valueBefore(step, 2)]).toEqual([0, 4, 4])
  expect([valueBefore(step, -1), valueBefore(step, 3)]).toEqual([NaN, NaN])
  expect(measures(step, 0, 2).mean).toBeCloseTo(1, 12)
  expect(measures(step, 1.5, 2).mean).toBeCloseTo(4, 12)
})

test('traces with jumps at different times share their rows', () => {
  const other = trace([0, 1], [1, 1], [1, 2], [1.5, 2], [3, 2])
  const [time, first, second] = withCommonTimes([step, other])
  expect([...time]).toEqual([0, 1, 1, 1.5, 1.5, 2, 3])
  expect([...first!]).toEqual([0, 0, 0, 0, 4, 4, undefined])
  expect([...second!]).toEqual([1, 1, 2, 2, 2, undefined, 2])
})

test('runs that jump at the same time do not differ there, independently of their other rows', () => {
  const run = (key: string, { time, values }: ReturnType<typeof trace>) => {
    const samples = new RunSamples(key, [{ name: 'a/y', shape: [], unit: '', entries: [] }], {})
    const header = JSON.stringify({ run: key, first: 0, count: time.length }).padEnd(60)
    const buffer = new ArrayBuffer(64 + 16 * time.length)
    new DataView(buffer).setUint32(0, 60, true)
    new Uint8Array(buffer, 4, 60).set(new TextEncoder().encode(header))
    new Float64Array(buffer, 64).set([...time, ...values])
    samples.receive(buffer)
    return samples
  }
  const coarse = run('coarse', step)
  const fine = run('fine', trace([0, 0], [0.5, 0], [1, 0], [1.5, 0], [1.5, 4], [1.7, 4], [2, 4]))
  expect(difference(coarse, fine, 'a/y', 0)?.largest).toBe(0)
  expect(difference(fine, coarse, 'a/y', 0)?.largest).toBe(0)
  const smooth = run('smooth', trace([0, 0], [2, 4]))
  expect([...difference(coarse, smooth, 'a/y', 0)!.values]).toEqual([0, 2, 3, -1, 0])
})
