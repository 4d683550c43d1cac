import { Line } from '@react-three/drei'
import { useFrame } from '@react-three/fiber'
import { useMemo, useRef } from 'react'
import { DoubleSide, Matrix4, type Group } from 'three'
import { matrixAt, matrixOf, type Poses, type RobotScene, type SceneJoint } from './scene'

const AXES = ['#d9362b', '#2f9e44', '#2b6fd6'] as const
const FULL_TURN = 2 * Math.PI

interface OverlayProps {
  scene: RobotScene
  poses: () => Poses | undefined
  dark: boolean
}

/** Objects in the frame of one row of the poses. */
function PoseGroup({
  row,
  poses,
  children,
}: {
  row: number
  poses: () => Poses | undefined
  children: React.ReactNode
}) {
  const group = useRef<Group>(null)
  const matrix = useMemo(() => new Matrix4(), [])
  useFrame(() => {
    const now = poses()
    if (!group.current) return
    group.current.visible = Boolean(now)
    if (!now) return
    group.current.matrix.copy(matrixAt(now, row, matrix))
    group.current.matrixWorldNeedsUpdate = true
  })
  return (
    <group ref={group} matrixAutoUpdate={false}>
      {children}
    </group>
  )
}

function Fixed({ at, children }: { at: number[]; children: React.ReactNode }) {
  const matrix = useMemo(() => matrixOf(at), [at])
  return (
    <group matrix={matrix} matrixAutoUpdate={false}>
      {children}
    </group>
  )
}

/** The frames of base, links and tool: x red, y green, z blue. */
export function Frames({ scene, poses }: OverlayProps) {
  return Array.from({ length: scene.rows }, (_, row) => {
    const size = (row === 0 || row === scene.rows - 1 ? 0.16 : 0.11) * scene.reach
    return (
      <PoseGroup key={row} row={row} poses={poses}>
        {AXES.map((color, axis) => (
          <Line
            toneMapped={false}
            key={axis}
            points={[[0, 0, 0], [0, 1, 2].map((k) => (k === axis ? size : 0)) as [number, number, number]]}
            color={color}
            lineWidth={2.4}
            depthTest={false}
            renderOrder={4}
          />
        ))}
      </PoseGroup>
    )
  })
}

/** The axes of the joints, as chain lines through them. */
export function JointAxes({ scene, poses, dark }: OverlayProps) {
  return scene.joints.map((joint) => {
    const half = Math.max(3.2 * joint.radius, 0.1 * scene.reach)
    return (
      <PoseGroup key={joint.name} row={joint.carrier} poses={poses}>
        <Fixed at={joint.frame}>
          <Line
            toneMapped={false}
            points={[
              [0, 0, -half],
              [0, 0, half],
            ]}
            color={dark ? '#e8ebf0' : '#23211e'}
            lineWidth={1.2}
            dashed
            dashSize={0.03 * scene.reach}
            gapSize={0.015 * scene.reach}
            depthTest={false}
            renderOrder={3}
          />
        </Fixed>
      </PoseGroup>
    )
  })
}

/** The ranges of the joints: an arc or a bar over the allowed range, and a pointer at the position. */
export function Limits({ scene, poses, dark }: OverlayProps) {
  return scene.joints.map((joint) => (
    <Range key={joint.name} joint={joint} poses={poses} dark={dark} reach={scene.reach} />
  ))
}

interface RangeProps {
  joint: SceneJoint
  poses: () => Poses | undefined
  dark: boolean
  reach: number
}

function Range({ joint, poses, dark, reach }: RangeProps) {
  if (!joint.limits) return null
  const shown = {
    joint,
    poses,
    reach,
    colour: dark ? '#3d9fdc' : '#0072b2',
    pointer: dark ? '#ff9a4d' : '#b04a00',
    inner: 1.3 * joint.radius,
    outer: 1.95 * joint.radius,
    low: joint.limits[0] + joint.offset,
    high: joint.limits[1] + joint.offset,
  }
  return joint.turns ? <Arc {...shown} /> : <Bar {...shown} />
}

interface ShownRange extends Omit<RangeProps, 'dark'> {
  colour: string
  pointer: string
  inner: number
  outer: number
  low: number
  high: number
}

function Bar({ joint, poses, colour, pointer, inner, outer, low, high }: ShownRange) {
  return (
    <>
      <PoseGroup row={joint.carrier} poses={poses}>
        <Fixed at={joint.frame}>
          <Line
            toneMapped={false}
            points={[
              [outer, 0, low],
              [outer, 0, high],
            ]}
            color={colour}
            lineWidth={5}
          />
        </Fixed>
      </PoseGroup>
      <PoseGroup row={joint.row} poses={poses}>
        <Fixed at={joint.moving}>
          <Line
            toneMapped={false}
            points={[
              [inner, 0, 0],
              [1.2 * outer, 0, 0],
            ]}
            color={pointer}
            lineWidth={3}
          />
        </Fixed>
      </PoseGroup>
    </>
  )
}

function Arc({ joint, poses, reach, colour, pointer, inner, outer, low, high }: ShownRange) {
  return (
    <>
      <PoseGroup row={joint.carrier} poses={poses}>
        <Fixed at={joint.frame}>
          <mesh renderOrder={3}>
            <ringGeometry args={[inner, outer, 64, 1, low, Math.min(high - low, FULL_TURN)]} />
            <meshBasicMaterial
              toneMapped={false}
              color={colour}
              transparent
              opacity={0.28}
              side={DoubleSide}
              depthWrite={false}
            />
          </mesh>
          {[low, high].map((angle, k) => (
            <Line
              toneMapped={false}
              key={k}
              points={[
                [inner * Math.cos(angle), inner * Math.sin(angle), 0],
                [outer * Math.cos(angle), outer * Math.sin(angle), 0],
              ]}
              color={colour}
              lineWidth={2}
            />
          ))}
        </Fixed>
      </PoseGroup>
      <PoseGroup row={joint.row} poses={poses}>
        <Fixed at={joint.moving}>
          <Line
            toneMapped={false}
            points={[
              [inner, 0, 0.002 * reach],
              [1.08 * outer, 0, 0.002 * reach],
            ]}
            color={pointer}
            lineWidth={3}
          />
        </Fixed>
      </PoseGroup>
    </>
  )
}
