import { useComputedColorScheme } from '@mantine/core'
import { Grid, Line, OrbitControls } from '@react-three/drei'
import { Canvas, useFrame } from '@react-three/fiber'
import { useEffect, useMemo, useRef, useState } from 'react'
import { Matrix4, Vector3, type Group } from 'three'
import { LineGeometry, type Line2 } from 'three-stdlib'
import { shownTime } from '../run/cursor'
import { samples } from '../samples'
import { ask, useStudio } from '../store'
import { geometry, type RobotScene } from './scene'

const MOST_TRACE = 600
const MATERIALS = {
  paint: { color: '#e8711a', metalness: 0.1, roughness: 0.45 },
  joint: { color: '#3c4047', metalness: 0.35, roughness: 0.5 },
  flange: { color: '#b9bdc3', metalness: 0.75, roughness: 0.3 },
} as const

/** The arm of the first robot block: as the run moves it, or at rest before the first run. */
export default function RobotView() {
  const document = useStudio((s) => s.document?.state.document)
  const blocks = useStudio((s) => s.document?.blocks)
  const block = useMemo(() => {
    const robots = Object.values(blocks ?? {}).filter(({ parameters }) => 'robot' in parameters)
    return (robots.find(({ type }) => type === 'RobotPlot') ?? robots[0])?.name
  }, [blocks])
  const source = block ? JSON.stringify(blocks?.[block]?.parameters['robot']) : undefined
  const [scene, setScene] = useState<RobotScene | null>(null)
  const [rest, setRest] = useState<number[][][] | null>(null)
  useEffect(() => {
    setScene(null)
    setRest(null)
    if (!document || !block) return
    let current = true
    void ask<RobotScene>({ kind: 'scene', document, block }).then(async (found) => {
      if (!found || !current) return
      const q = found.joints.map(({ limits }) => (limits ? Math.min(Math.max(0, limits[0]), limits[1]) : 0))
      const poses = await ask<number[][][]>({ kind: 'pose', document, block, q })
      if (!current) return
      setScene(found)
      setRest(poses ?? null)
    })
    return () => {
      current = false
    }
  }, [document, block, source])
  if (!block) return <p className="empty">The model has no robot: add a Robot Plot to see its arm here.</p>
  if (!scene || !rest) return <p className="empty">Loading the robot …</p>
  return <Stage scene={scene} rest={rest} block={block} />
}

function Stage({ scene, rest, block }: { scene: RobotScene; rest: number[][][]; block: string }) {
  const dark = useComputedColorScheme('light') === 'dark'
  const { reach } = scene
  return (
    <div className="robot" role="img" aria-label={`The robot ${scene.name}`}>
      <Canvas shadows dpr={[1, 2]} camera={{ position: [1.6 * reach, -1.9 * reach, 1.35 * reach], up: [0, 0, 1], fov: 38, near: 0.02 * reach, far: 40 * reach }}>
        <color attach="background" args={[dark ? '#151a20' : '#f1eeea']} />
        <hemisphereLight args={['#ffffff', dark ? '#2a313b' : '#b8b0a6', dark ? 0.9 : 1.3]} />
        <directionalLight
          position={[2 * reach, -1.5 * reach, 3.5 * reach]}
          intensity={2.2}
          castShadow
          shadow-mapSize={[2048, 2048]}
          shadow-camera-left={-1.6 * reach}
          shadow-camera-right={1.6 * reach}
          shadow-camera-top={1.6 * reach}
          shadow-camera-bottom={-1.6 * reach}
          shadow-camera-far={9 * reach}
          shadow-normalBias={0.01 * reach}
        />
        <directionalLight position={[-2 * reach, 2 * reach, 1.5 * reach]} intensity={0.5} />
        <Arm scene={scene} rest={rest} block={block} />
        <ToolPath scene={scene} block={block} dark={dark} />
        <Ground rest={rest} reach={reach} dark={dark} />
        <OrbitControls makeDefault target={[0, 0, 0.35 * reach]} />
      </Canvas>
    </div>
  )
}

/** Poses (rows × 16 numbers, row by row) of the run at the instant shown; undefined before a run. */
function posesNow(block: string, rows: number): ((row: number, k: number) => number) | undefined {
  const { run } = useStudio.getState()
  const view = run?.views.find((one) => one.kind === 'robot' && one.block === block)
  const found = view && samples.signal(`${block}/${view.signals[0]}`)
  const index = samples.indexAt(shownTime())
  if (!found || index < 0 || found.columns.length !== 16 * rows) return undefined
  return (row, k) => found.columns[16 * row + k]![index]!
}

function Arm({ scene, rest, block }: { scene: RobotScene; rest: number[][][]; block: string }) {
  const groups = useRef<(Group | null)[]>([])
  const bodies = useMemo(() => scene.bodies.map((body) => ({ ...body, geometry: geometry(body) })), [scene])
  useEffect(() => () => bodies.forEach((body) => body.geometry.dispose()), [bodies])
  const matrix = useMemo(() => new Matrix4(), [])
  useFrame(() => {
    const moved = posesNow(block, scene.rows)
    for (let row = 0; row < scene.rows; row++) {
      const group = groups.current[row]
      if (!group) continue
      const at = (k: number) => (moved ? moved(row, k) : rest[row]![k >> 2]![k & 3]!)
      matrix.set(at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8), at(9), at(10), at(11), 0, 0, 0, 1)
      group.matrix.copy(matrix)
      group.matrixWorldNeedsUpdate = true
    }
  })
  return (
    <>
      {Array.from({ length: scene.rows }, (_, row) => (
        <group key={row} ref={(group) => void (groups.current[row] = group)} matrixAutoUpdate={false}>
          {bodies
            .filter((body) => body.row === row)
            .map((body, k) => (
              <mesh key={k} geometry={body.geometry} castShadow receiveShadow>
                <meshStandardMaterial {...MATERIALS[body.material]} />
              </mesh>
            ))}
        </group>
      ))}
    </>
  )
}

/** The way of the tool up to the instant shown. */
function ToolPath({ scene, block, dark }: { scene: RobotScene; block: string; dark: boolean }) {
  const line = useRef<Line2>(null)
  const seen = useRef('')
  const start = useMemo(() => [new Vector3(), new Vector3(0, 0, 1e-6)], [])
  useFrame(() => {
    const { run } = useStudio.getState()
    const view = run?.views.find((one) => one.kind === 'robot' && one.block === block)
    const found = view && samples.signal(`${block}/${view.signals[0]}`)
    const last = samples.indexAt(shownTime())
    const key = `${samples.version} ${last}`
    if (!line.current || key === seen.current) return
    seen.current = key
    line.current.visible = Boolean(found) && last > 0
    if (!found || last < 1) return
    const tool = 16 * (scene.rows - 1)
    const stride = Math.max(1, Math.ceil(last / MOST_TRACE))
    const points: number[] = []
    const put = (k: number) => points.push(found.columns[tool + 3]![k]!, found.columns[tool + 7]![k]!, found.columns[tool + 11]![k]!)
    for (let k = 0; k < last; k += stride) put(k)
    put(last)
    // A geometry keeps the count of instances that it had first: a longer line needs a new one.
    line.current.geometry.dispose()
    line.current.geometry = new LineGeometry()
    line.current.geometry.setPositions(points)
  })
  return <Line ref={line as React.Ref<never>} points={start} color={dark ? '#3d9fdc' : '#0072b2'} lineWidth={2} frustumCulled={false} />
}

function Ground({ rest, reach, dark }: { rest: number[][][]; reach: number; dark: boolean }) {
  const height = (rest[0]?.[2]?.[3] ?? 0) - 0.002 * reach
  return (
    <>
      <mesh position={[0, 0, height - 0.004 * reach]} receiveShadow>
        <planeGeometry args={[8 * reach, 8 * reach]} />
        <shadowMaterial opacity={dark ? 0.45 : 0.22} />
      </mesh>
      <Grid
        position={[0, 0, height]}
        rotation={[Math.PI / 2, 0, 0]}
        args={[8 * reach, 8 * reach]}
        cellSize={reach > 1 ? 0.25 : 0.1}
        sectionSize={reach > 1 ? 1 : 0.5}
        cellColor={dark ? '#2a313b' : '#ddd7cf'}
        sectionColor={dark ? '#3d4652' : '#c4bcb1'}
        fadeDistance={7 * reach}
        infiniteGrid
      />
    </>
  )
}
