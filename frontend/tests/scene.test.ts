import { expect, test } from 'vitest'
import { posesForScene, type RobotScene } from '../src/robot/scene'

const scene: RobotScene = { name: 'arm', reach: 1, foot: 0, rows: 3, bodies: [], joints: [], rest: [] }
const row = [
  [1, 2, 3, 4],
  [5, 6, 7, 8],
]

test('bodies are not drawn with poses of another number of rows', () => {
  const poses = posesForScene(scene, [row, row, row])
  expect([poses?.(2, 3), poses?.(1, 4)]).toEqual([4, 5])
  expect(posesForScene(scene, [row, row])).toBeUndefined()
  expect(posesForScene(scene, [row, row, row, row])).toBeUndefined()
  expect(posesForScene(scene, undefined)).toBeUndefined()
  expect(posesForScene(null, [row])).toBeUndefined()
})
