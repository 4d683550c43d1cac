/** A pose as 16 numbers of the 4 × 4 matrix, row by row, m. */
export type PoseMatrix = number[]

export type Axes = 'tool' | 'world'

/** Position x, y, z in m, and roll, pitch, yaw in rad of R = Rz(yaw) Ry(pitch) Rx(roll). */
export function coordinatesOf(T: PoseMatrix): number[] {
  const [xx, xy, , x, yx, yy, , y, zx, zy, zz, z] = T as [
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
  ]
  const pitch = Math.atan2(-zx, Math.hypot(zy, zz))
  // Where cos(pitch) is 0, only the difference of roll and yaw is determined: roll is 0.
  if (Math.hypot(xx, yx) < 1e-9) return [x, y, z, 0, pitch, Math.atan2(-xy, yy)]
  return [x, y, z, Math.atan2(zy, zz), pitch, Math.atan2(yx, xx)]
}

/** The pose with these coordinates; the inverse of `coordinatesOf`. */
export function poseOf(coordinates: number[]): PoseMatrix {
  const [x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0] = coordinates
  const R = product(product(rotation(2, yaw), rotation(1, pitch)), rotation(0, roll))
  return withPosition(R, [x, y, z])
}

/**
 * The pose after a motion of the tool: directions 0 to 2 are translations along x, y, z in m, directions 3 to
 * 5 rotations about x, y, z through the tool's origin in rad.
 */
export function moved(T: PoseMatrix, direction: number, amount: number, axes: Axes): PoseMatrix {
  const R = [0, 1, 2].map((row) => T.slice(4 * row, 4 * row + 3))
  const position = [T[3]!, T[7]!, T[11]!]
  if (direction < 3) {
    const step = R.map((row, k) => (axes === 'tool' ? row[direction]! : k === direction ? 1 : 0) * amount)
    return withPosition(
      R,
      position.map((value, k) => value + step[k]!),
    )
  }
  const turn = rotation(direction - 3, amount)
  return withPosition(axes === 'tool' ? product(R, turn) : product(turn, R), position)
}

function rotation(axis: number, angle: number): number[][] {
  const [c, s] = [Math.cos(angle), Math.sin(angle)]
  const [j, k] = [(axis + 1) % 3, (axis + 2) % 3]
  const R = [0, 1, 2].map((row) => [0, 1, 2].map((column) => Number(row === column)))
  R[j]![j] = R[k]![k] = c
  R[j]![k] = -s
  R[k]![j] = s
  return R
}

const product = (A: number[][], B: number[][]) =>
  A.map((row) => [0, 1, 2].map((k) => row[0]! * B[0]![k]! + row[1]! * B[1]![k]! + row[2]! * B[2]![k]!))

const withPosition = (R: number[][], position: number[]) => [
  ...R.flatMap((row, k) => [...row, position[k]!]),
  0,
  0,
  0,
  1,
]
