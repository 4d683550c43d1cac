import { expect, test } from 'vitest'
import { isAtLimit, MotionPoses, shareOf } from '../../src/model/motion'

const packed = (values: number[]) =>
  btoa(String.fromCharCode(...new Uint8Array(new Float32Array(values).buffer)))

test('the poses of a motion are those of the nearest sample', () => {
  const values = Array.from({ length: 3 * 2 * 12 }, (_, k) => k)
  const motion = new MotionPoses({ time: [0, 0.5, 1], rows: 2, poses: packed(values) })
  expect([-1, 0, 0.2, 0.3, 0.9, 5].map((time) => motion.indexAt(time))).toEqual([0, 0, 0, 1, 2, 2])
  expect(motion.at(1)[1]).toEqual([
    [36, 37, 38, 39],
    [40, 41, 42, 43],
    [44, 45, 46, 47],
    [0, 0, 0, 1],
  ])
  expect(motion.tool(2)).toEqual([63, 67, 71])
  expect(new MotionPoses({ time: [0], rows: 1, poses: packed(values.slice(0, 12)) }).indexAt(3)).toBe(0)
})

test('without a limit, the share is undefined and no limit is reached', () => {
  expect(shareOf(0.5, 2)).toBe(25)
  expect([shareOf(1, null), shareOf(1, 0)]).toEqual([undefined, undefined])
  expect([isAtLimit(1, -1, 1), isAtLimit(0.999, -1, 1), isAtLimit(-1, -1, 1)]).toEqual([true, false, true])
  expect([isAtLimit(9, null, null), isAtLimit(2, null, 1), isAtLimit(-9, null, 1)]).toEqual([
    false,
    true,
    false,
  ])
})
