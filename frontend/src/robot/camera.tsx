import { CameraControls } from '@react-three/drei'
import { useFrame, useThree } from '@react-three/fiber'
import { useEffect, useMemo, useRef } from 'react'
import { Box3, BufferGeometry, Matrix4, Mesh, Vector3, type Object3D, type PerspectiveCamera } from 'three'
import { matrixAt, type Poses, type RobotScene } from './scene'
import { useViewOptions } from './view_options'

/** Camera directions; "tool" is behind the tool and moves with it. */
export const PRESETS = {
  iso: [0.62, -0.68, 0.42],
  front: [1, 0, 0.06],
  side: [0, -1, 0.06],
  top: [0.001, 0, 1],
} as const

export type Preset = keyof typeof PRESETS | 'tool'

/** Commands from the buttons of the view to its camera. */
export interface CameraHandle {
  look: (preset: Preset) => void
  fit: () => void
  turn: (right: number, up: number) => void
  zoom: (factor: number) => void
}

/** Factor by which the view is larger than the visible items. */
const MARGIN = 1.14

/** The corners of the bounding boxes of the bodies, in the axes of their links. */
function cornersOf(arm: Object3D): Vector3[] {
  const corners: Vector3[] = []
  arm.traverse((object) => {
    if (!(object instanceof Mesh) || !(object.geometry instanceof BufferGeometry)) return
    object.geometry.computeBoundingBox()
    const { min, max } = object.geometry.boundingBox!
    for (let k = 0; k < 8; k++)
      corners.push(
        new Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z).applyMatrix4(
          object.matrixWorld,
        ),
      )
  })
  return corners
}

/** Corners of all visible items: the arm, the positions reached in a run, the floor below the base. */
function visibleCorners(
  arm: Object3D,
  floor: number,
  extent: CameraProps['extent'],
  padding: number,
): Vector3[] {
  const corners = cornersOf(arm)
  for (const [x, y, z] of extent?.() ?? [])
    corners.push(new Vector3(x, y, z + padding), new Vector3(x, y, z - padding))
  corners.push(new Vector3(0, 0, floor))
  return corners
}

/**
 * The position of a camera that looks at `centre` and sees all corners, at least at `minDistance`.
 */
function eyeOf(
  corners: Vector3[],
  centre: Vector3,
  direction: Vector3,
  camera: PerspectiveCamera,
  minDistance: number,
): Vector3 {
  const d = direction.clone().normalize()
  const right = new Vector3(0, 0, 1).cross(d)
  if (right.lengthSq() < 1e-6) right.set(0, 1, 0)
  right.normalize()
  const up = d.clone().cross(right)
  const halfHeight = Math.tan(((camera.fov / 2) * Math.PI) / 180) / MARGIN
  const halfWidth = halfHeight * camera.aspect
  let distance = minDistance
  for (const corner of corners) {
    const p = corner.sub(centre)
    distance = Math.max(
      distance,
      p.dot(d) + Math.max(Math.abs(p.dot(right)) / halfWidth, Math.abs(p.dot(up)) / halfHeight),
    )
  }
  return centre.clone().addScaledVector(d, distance)
}

/** Working vectors of the frame callback, allocated once. */
const newScratch = () => ({
  matrix: new Matrix4(),
  tool: new Vector3(),
  last: new Vector3(),
  eye: new Vector3(),
  to: new Vector3(),
})
type Scratch = ReturnType<typeof newScratch>

function placeBehindTool(now: CameraControls, { matrix, eye, to }: Scratch, reach: number): void {
  // A hand camera: behind the tool and a little above, in the direction of the tool's axis.
  eye.set(-0.16 * reach, 0, -0.3 * reach).applyMatrix4(matrix)
  to.set(0, 0, 0.35 * reach).applyMatrix4(matrix)
  void now.setLookAt(eye.x, eye.y, eye.z, to.x, to.y, to.z, false)
}

function followTool(now: CameraControls, { tool, last, eye, to }: Scratch): void {
  const shift = tool.clone().sub(last)
  last.copy(tool)
  if (shift.lengthSq() === 0) return
  now.getPosition(eye).add(shift)
  now.getTarget(to).add(shift)
  void now.setLookAt(eye.x, eye.y, eye.z, to.x, to.y, to.z, false)
}

interface CameraProps {
  scene: RobotScene
  poses: () => Poses | undefined
  floor: number
  extent: (() => [number, number, number][]) | undefined
  extentKey: string | undefined
  handle: React.RefObject<CameraHandle | null>
}

interface View {
  controls: React.RefObject<CameraControls | null>
  onTool: React.RefObject<boolean>
  userMoved: React.RefObject<boolean>
  camera: PerspectiveCamera
  fit: (direction: Vector3, smooth: boolean) => void
  invalidate: () => void
}

/** The commands of the camera for other components. */
function handleOf({ controls, onTool, userMoved, camera, fit, invalidate }: View): CameraHandle {
  return {
    look: (preset) => {
      userMoved.current = true
      if (preset === 'tool') {
        onTool.current = true
        invalidate()
      } else fit(new Vector3(...PRESETS[preset]), true)
    },
    fit: () => fit(camera.position.clone().sub(controls.current!.getTarget(new Vector3())), true),
    turn: (right, up) => {
      onTool.current = false
      userMoved.current = true
      void controls.current?.rotate(right, up, true)
      invalidate()
    },
    zoom: (factor) => {
      const now = controls.current
      userMoved.current = true
      if (now) void now.dollyTo(now.distance * factor, true)
      invalidate()
    },
  }
}

export function ViewCamera({ scene, poses, floor, extent, extentKey, handle }: CameraProps) {
  const controls = useRef<CameraControls>(null)
  const onTool = useRef(false)
  const userMoved = useRef(false)
  const invalidate = useThree((s) => s.invalidate)
  const world = useThree((s) => s.scene)
  const camera = useThree((s) => s.camera) as PerspectiveCamera
  const follow = useViewOptions((s) => s.follow)
  const scratch = useMemo(newScratch, [])

  const toolAt = (into: Vector3): boolean => {
    const now = poses()
    if (!now) return false
    into.setFromMatrixPosition(matrixAt(now, scene.rows - 1, scratch.matrix))
    return true
  }

  const fit = (direction: Vector3, smooth: boolean) => {
    const arm = world.getObjectByName('arm')
    if (!arm || !controls.current) return
    world.updateMatrixWorld(true)
    const corners = visibleCorners(arm, floor, extent, 0.05 * scene.reach)
    const centre = new Box3().setFromPoints(corners).getCenter(new Vector3())
    const eye = eyeOf(corners, centre, direction, camera, 0.1 * scene.reach)
    onTool.current = false
    void controls.current.setLookAt(eye.x, eye.y, eye.z, centre.x, centre.y, centre.z, smooth)
    invalidate()
  }

  handle.current = handleOf({ controls, onTool, userMoved, camera, fit, invalidate })

  // Until the user moves the view, it is fitted to every size of its panel.
  const size = useThree((s) => s.size)
  useEffect(() => {
    if (!userMoved.current) fit(new Vector3(...PRESETS.iso), false)
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [size.width, size.height, floor, extentKey])

  // A new robot is shown completely. Edits of a robot do not move the camera.
  useEffect(() => {
    userMoved.current = false
    const timer = setTimeout(() => fit(new Vector3(...PRESETS.iso), false), 0)
    return () => clearTimeout(timer)
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [scene.name])

  useEffect(() => {
    if (follow) toolAt(scratch.last)
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [follow])

  useFrame(() => {
    const now = controls.current
    // Until the user moves the view, it is extended to all positions that the run has reached.
    if (!userMoved.current && !follow && toolAt(scratch.tool)) {
      const { x, y } = scratch.tool.project(camera)
      if (Math.max(Math.abs(x), Math.abs(y)) > 1) fit(new Vector3(...PRESETS.iso), false)
    }
    if (!now || (!follow && !onTool.current) || !toolAt(scratch.tool)) return
    if (onTool.current) placeBehindTool(now, scratch, scene.reach)
    else followTool(now, scratch)
  })

  return (
    <CameraControls
      ref={controls}
      makeDefault
      minDistance={0.08 * scene.reach}
      maxDistance={15 * scene.reach}
      smoothTime={0.12}
      draggingSmoothTime={0.04}
      onControlStart={() => {
        onTool.current = false
        userMoved.current = true
      }}
    />
  )
}
