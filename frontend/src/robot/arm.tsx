import { useFrame } from '@react-three/fiber'
import { useEffect, useMemo, useRef } from 'react'
import { type BufferGeometry, Matrix4, type Group } from 'three'
import { geometry, matrixAt, rodMatrix, type Material, type Poses, type RobotScene } from './scene'

export const MATERIALS: Record<Material, { color: string; metalness: number; roughness: number }> = {
  paint: { color: '#e8711a', metalness: 0.0, roughness: 0.38 },
  joint: { color: '#33373d', metalness: 0.25, roughness: 0.55 },
  flange: { color: '#c3c7cc', metalness: 0.9, roughness: 0.28 },
  base: { color: '#4a4f57', metalness: 0.2, roughness: 0.6 },
}

export interface Body {
  row: number
  material: Material
  geometry: BufferGeometry
}

/** The bodies of a scene as geometry, which is disposed with the scene. */
export function useBodies(scene: RobotScene): Body[] {
  const bodies = useMemo(
    () => scene.bodies.map((body) => ({ row: body.row, material: body.material, geometry: geometry(body) })),
    [scene],
  )
  useEffect(() => () => bodies.forEach((body) => body.geometry.dispose()), [bodies])
  return bodies
}

interface ArmProps {
  scene: RobotScene
  bodies: Body[]
  poses: () => Poses | undefined
  /** The colour of a ghost, which shows a past or future pose of the arm. */
  ghost?: string
}

/** The bodies at the present poses. */
export function Arm({ scene, bodies, poses, ghost }: ArmProps) {
  const { rows, rods } = scene
  const groups = useRef<(Group | null)[]>([])
  const matrix = useMemo(() => new Matrix4(), [])
  useFrame(() => {
    const now = poses()
    groups.current.forEach((group, row) => {
      if (!group) return
      group.visible = Boolean(now)
      if (!now) return
      const rod = rods[row - rows]
      group.matrix.copy(rod ? rodMatrix(now, rod, matrix) : matrixAt(now, row, matrix))
      group.matrixWorldNeedsUpdate = true
    })
  })
  const first = ghost ? 1 : 0 // a ghost shares the base of the arm
  return (
    <group name={ghost ? 'ghost' : 'arm'}>
      {Array.from({ length: rows + rods.length - first }, (_, k) => k + first).map((row) => (
        <group key={row} ref={(group) => void (groups.current[row] = group)} matrixAutoUpdate={false}>
          {bodies
            .filter((body) => body.row === row)
            .map((body, k) =>
              ghost ? (
                <GhostBody key={k} geometry={body.geometry} colour={ghost} />
              ) : (
                <SolidBody key={k} {...body} />
              ),
            )}
        </group>
      ))}
    </group>
  )
}

function SolidBody({ geometry, material }: Body) {
  return (
    <mesh geometry={geometry} castShadow receiveShadow>
      <meshStandardMaterial {...MATERIALS[material]} />
    </mesh>
  )
}

/** Depth offset of a ghost, so that coincident surfaces of the arm hide it without flicker. */
const GHOST_OFFSET = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 }

/** Depth is drawn before colour, so that the transparent bodies of a ghost do not add up. */
function GhostBody({ geometry, colour }: { geometry: BufferGeometry; colour: string }) {
  return (
    <>
      <mesh geometry={geometry} renderOrder={1}>
        <meshBasicMaterial colorWrite={false} transparent {...GHOST_OFFSET} />
      </mesh>
      <mesh geometry={geometry} renderOrder={2}>
        <meshLambertMaterial color={colour} transparent opacity={0.22} depthWrite={false} {...GHOST_OFFSET} />
      </mesh>
    </>
  )
}
