import { BufferAttribute, BufferGeometry, Matrix4, Vector3 } from 'three'
import { unpackedFloats } from '../model/packed'
import type { RobotScene, SceneJoint } from '../protocol'

export type { RobotScene, SceneJoint }

export type Material = RobotScene['bodies'][number]['material']

/** Entry `k` (0 to 15, row by row) of the 4 × 4 pose matrix with the index `row`. */
export type Poses = (row: number, k: number) => number

/** Poses in the format of the server: (rows, 4, 4). */
export function posesFromRows(poses: number[][][]): Poses {
  return (row, k) => poses[row]![k >> 2]![k & 3]!
}

/**
 * Poses for the bodies of a scene, or undefined if the numbers of rows differ: after a link is added or
 * removed, bodies and poses arrive one after the other.
 */
export function posesForScene(scene: RobotScene | null, poses: number[][][] | undefined): Poses | undefined {
  return scene && poses?.length === scene.rows ? posesFromRows(poses) : undefined
}

export function matrixAt(poses: Poses, row: number, target: Matrix4): Matrix4 {
  const entry = (k: number) => poses(row, k)
  return target.set(
    entry(0),
    entry(1),
    entry(2),
    entry(3),
    entry(4),
    entry(5),
    entry(6),
    entry(7),
    entry(8),
    entry(9),
    entry(10),
    entry(11),
    0,
    0,
    0,
    1,
  )
}

/** The pose of a rod: its origin is the first end, z points to the second end. */
export function rodMatrix(poses: Poses, rod: RobotScene['rods'][number], target: Matrix4): Matrix4 {
  const first = new Vector3().fromArray(rod.first).applyMatrix4(matrixAt(poses, rod.first_row, target))
  const second = new Vector3().fromArray(rod.second).applyMatrix4(matrixAt(poses, rod.second_row, target))
  const z = second.sub(first)
  if (z.lengthSq() === 0) z.set(0, 0, 1)
  z.normalize()
  const side = Math.abs(z.x) < 0.7 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0)
  const y = side.cross(z).negate().normalize()
  return target.makeBasis(new Vector3().crossVectors(y, z), y, z).setPosition(first)
}

export function matrixOf(numbers: number[]): Matrix4 {
  return new Matrix4().fromArray(numbers).transpose()
}

export function geometry(body: RobotScene['bodies'][number]): BufferGeometry {
  const geometry = new BufferGeometry()
  geometry.setAttribute('position', new BufferAttribute(unpackedFloats(body.corners), 3))
  geometry.setAttribute('normal', new BufferAttribute(unpackedFloats(body.normals), 3))
  return geometry
}
