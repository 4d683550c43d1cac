import { expect, test } from 'vitest'
import { fitting, type RobotScene } from '../src/robot/scene'

const scene: RobotScene = { name: 'arm', reach: 1, foot: 0, rows: 3, bodies: [], joints: [] }
const row = [
  [1, 2, 3, 4],
  [5, 6, 7, 8],
]

test('bodies are not drawn with poses of another number of rows', () => {
  const poses = fitting(scene, [row, row, row])
  expect([poses?.(2, 3), poses?.(1, 4)]).toEqual([4, 5])
  expect(fitting(scene, [row, row])).toBeUndefined()
  expect(fitting(scene, [row, row, row, row])).toBeUndefined()
  expect(fitting(scene, undefined)).toBeUndefined()
  expect(fitting(null, [row])).toBeUndefined()
})
