import { TransformControls } from '@react-three/drei'
import { useFrame, useThree } from '@react-three/fiber'
import { useMemo, useRef } from 'react'
import { Matrix4, type Object3D, Vector3 } from 'three'
import type { Axes, PoseMatrix } from '../../model/tool_pose'
import { matrixAt, type Poses } from '../scene'

interface ToolHandleProps {
  poses: () => Poses | undefined
  /** Index of the tool in the poses. */
  row: number
  mode: 'translate' | 'rotate'
  axes: Axes
  /** Called while the handle is dragged, with the pose to which it was moved. */
  onDrag: (target: PoseMatrix) => void
}

/** Arrows or rings at the tool of an arm, with which the mouse moves or turns the tool. */
export function ToolHandle({ poses, row, mode, axes, onDrag }: ToolHandleProps) {
  const handle = useRef<Object3D>(null)
  const isDragged = useRef(false)
  const invalidate = useThree((s) => s.invalidate)
  const canvas = useThree((s) => s.gl.domElement)
  const scratch = useMemo(() => ({ matrix: new Matrix4(), point: new Vector3() }), [])
  useFrame(({ camera, size }) => {
    const now = poses()
    if (!handle.current || !now) return
    if (!isDragged.current) {
      matrixAt(now, row, scratch.matrix)
      scratch.matrix.decompose(handle.current.position, handle.current.quaternion, handle.current.scale)
    }
    // Where the handle is on the page, for programs that operate the page.
    const { x, y } = scratch.point.copy(handle.current.position).project(camera)
    canvas.dataset['handle'] = `${((x + 1) / 2) * size.width} ${((1 - y) / 2) * size.height}`
  })
  return (
    <>
      <object3D ref={handle} />
      <TransformControls
        object={handle as React.RefObject<Object3D>}
        mode={mode}
        space={axes === 'tool' ? 'local' : 'world'}
        size={0.8}
        onMouseDown={() => void (isDragged.current = true)}
        onMouseUp={() => {
          isDragged.current = false
          invalidate()
        }}
        onObjectChange={() => {
          if (!isDragged.current || !handle.current) return
          handle.current.updateMatrix()
          onDrag(handle.current.matrix.clone().transpose().toArray())
        }}
      />
    </>
  )
}

/** Positions that the tool reaches within the limits of the joints. */
export function Workspace({ points, size, dark }: { points: Float32Array; size: number; dark: boolean }) {
  return (
    <points frustumCulled={false}>
      <bufferGeometry key={points.length}>
        <bufferAttribute attach="attributes-position" args={[points, 3]} />
      </bufferGeometry>
      <pointsMaterial
        size={size}
        color={dark ? '#3d9fdc' : '#0072b2'}
        transparent
        opacity={0.35}
        depthWrite={false}
        toneMapped={false}
      />
    </points>
  )
}
