import { Matrix4, Vector3 } from 'three'
import { expect, test } from 'vitest'
import { posesForScene, posesFromRows, rodMatrix, type RobotScene } from '../src/robot/scene'

const scene: RobotScene = {
  name: 'arm',
  reach: 1,
  foot: 0,
  rows: 3,
  bodies: [],
  joints: [],
  rods: [],
  rest: [],
}
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

test('a rod points from its first to its second end', () => {
  const at = (x: number, y: number, z: number) => [
    [1, 0, 0, x],
    [0, 1, 0, y],
    [0, 0, 1, z],
    [0, 0, 0, 1],
  ]
  const poses = posesFromRows([at(0, 0, 0), at(0, 3, 4)])
  const rod = { first_row: 0, first: [1, 0, 0], second_row: 1, second: [1, 0, 0] }
  const end = new Vector3(0, 0, 5).applyMatrix4(rodMatrix(poses, rod, new Matrix4()))
  expect(end.distanceTo(new Vector3(1, 3, 4))).toBeLessThan(1e-12)
  expect(rodMatrix(poses, rod, new Matrix4()).determinant()).toBeCloseTo(1)
})
