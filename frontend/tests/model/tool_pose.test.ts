import { expect, test } from 'vitest'
import { coordinatesOf, moved, poseOf } from '../../src/model/tool_pose'

/** Deterministic numbers from 0 to 1 (a linear congruential generator). */
function numbers(seed: number): () => number {
  let state = seed
  return () => (state = (1664525 * state + 1013904223) % 2 ** 32) / 2 ** 32
}

const near = (one: number[], other: number[]) =>
  one.forEach((value, k) => expect(value).toBeCloseTo(other[k]!, 12))

test('a pose is the inverse of its coordinates', () => {
  const next = numbers(1)
  for (let k = 0; k < 100; k++) {
    const coordinates = Array.from({ length: 3 }, () => 4 * next() - 2)
    coordinates.push(6.2 * next() - 3.1, 3 * next() - 1.5, 6.2 * next() - 3.1)
    near(coordinatesOf(poseOf(coordinates)), coordinates)
  }
  // At a pitch of 90° the angles are not unique, but the pose is the same.
  const upright = poseOf([1, 2, 3, 0.4, Math.PI / 2, 0.7])
  near(poseOf(coordinatesOf(upright)), upright)
})

test('a pose has the axes of R = Rz(yaw) Ry(pitch) Rx(roll)', () => {
  near(poseOf([1, 2, 3, 0, 0, Math.PI / 2]), [0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1])
  near(poseOf([0, 0, 0, Math.PI / 2, 0, 0]), [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1])
})

test('steps move along the axes of the world or of the tool, and turn about the origin of the tool', () => {
  const T = poseOf([0.5, 0, 1, 0, 0, Math.PI / 2])
  near(coordinatesOf(moved(T, 0, 0.1, 'world')).slice(0, 3), [0.6, 0, 1])
  near(coordinatesOf(moved(T, 0, 0.1, 'tool')).slice(0, 3), [0.5, 0.1, 1])
  const next = numbers(2)
  for (let direction = 0; direction < 6; direction++)
    for (const axes of ['tool', 'world'] as const) {
      const start = poseOf(Array.from({ length: 6 }, next))
      const there = moved(start, direction, 0.3, axes)
      near(moved(there, direction, -0.3, axes), start)
      if (direction >= 3) near([there[3]!, there[7]!, there[11]!], [start[3]!, start[7]!, start[11]!])
    }
})
