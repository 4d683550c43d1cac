import { BufferAttribute, BufferGeometry } from 'three'

/** What the server says of a robot's bodies: see `robot_scene.py`. */
export interface RobotScene {
  name: string
  reach: number
  rows: number
  bodies: { row: number; material: 'paint' | 'joint' | 'flange'; corners: string; normals: string }[]
  joints: { name: string; row: number; turns: boolean; limits: [number, number] | null }[]
}

function numbers(packed: string): Float32Array {
  const text = atob(packed)
  const bytes = new Uint8Array(text.length)
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k)
  return new Float32Array(bytes.buffer)
}

export function geometry(body: RobotScene['bodies'][number]): BufferGeometry {
  const made = new BufferGeometry()
  made.setAttribute('position', new BufferAttribute(numbers(body.corners), 3))
  made.setAttribute('normal', new BufferAttribute(numbers(body.normals), 3))
  return made
}
