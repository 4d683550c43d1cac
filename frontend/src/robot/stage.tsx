import { useComputedColorScheme } from '@mantine/core'
import { Environment, Grid, Lightformer } from '@react-three/drei'
import { Canvas, useFrame, useThree } from '@react-three/fiber'
import { memo, useEffect, useRef, useState } from 'react'
import { useMenuHandlers, openMenu, type Entries } from '../context_menu_state'
import { onFrame } from '../frames'
import { Arm, MATERIALS, useBodies } from './arm'
import { ViewCamera, type CameraHandle } from './camera'
import { Frames, JointAxes, Limits } from './overlays'
import { savePicture, type Rendering } from './pictures'
import type { Poses, RobotScene } from './scene'
import { StaticArm } from './static_arm'
import { ToolPath, type ToolPathPoints } from './tool_path'
import { toggle, useViewOptions } from './view_options'
import { armEntries, ViewTools } from './view_tools'

const KEY_HELP =
  'Arrow keys turn the view, plus and minus bring it nearer or farther, space shows all of the arm.'

const COLOURS = {
  light: {
    background: '#f1eeea',
    cell: '#e2dcd4',
    section: '#cbc3b8',
    shadow: 0.24,
    start: '#635d55',
    goal: '#0072b2',
  },
  dark: {
    background: '#151a20',
    cell: '#262d36',
    section: '#39424d',
    shadow: 0.5,
    start: '#a3adba',
    goal: '#3d9fdc',
  },
}

/** Past and future poses that are shown in addition to the arm. */
export interface Ghosts {
  start: () => Poses | undefined
  goal: () => Poses | undefined
}

interface StageProps {
  scene: RobotScene
  poses: () => Poses | undefined
  /**
   * A text that changes with the poses; the caller then calls `scheduleFrame`. An unchanged scene is not
   * redrawn.
   */
  state: () => string
  path?: () => ToolPathPoints | undefined
  ghosts?: Ghosts
  /** Poses over the whole run, for the extent of the view and the height of the floor. */
  extent?: () => [number, number, number][]
  /** Changes when the extent is complete. */
  extentKey?: string
  /** The drawing for browsers without WebGL. */
  drawing: () => Promise<string | undefined>
  /** Changes when the drawing changes; without it, the drawing is requested once. */
  drawn?: () => string
  /**
   * Plays the run from its start and resolves at its end, for a video; without it no video can be recorded.
   */
  playForVideo?: () => Promise<void>
  /** Additional entries at the start of the context menu. */
  entries?: () => Entries
  /** Objects in the scene in addition to the arm, such as a handle of its tool. */
  contents?: React.ReactNode
  /** A handler of keys, called before the handlers of the view; returns whether it has handled the key. */
  onKey?: (event: React.KeyboardEvent) => boolean
  /** Whether an arm that reaches below its foot stands on a column; the default is true. */
  pedestal?: boolean
  /** Additional buttons before the usual buttons. */
  children?: React.ReactNode
}

/** Rotation of the view by one key press, rad. */
const TURN = Math.PI / 24
const noState = () => ''

/** An arm on a floor, with light, shadow, camera and view tools. */
export function Stage(props: StageProps) {
  const { scene, poses, state, drawing, drawn, playForVideo, children, entries } = props
  const scheme = useComputedColorScheme('light')
  const camera = useRef<CameraHandle>(null)
  const rendering = useRef<Rendering | null>(null)
  const [hasWebGlSupport] = useState(hasWebGl)
  const tools = {
    onPicture: () => savePicture(rendering, scene.name),
    hasPath: Boolean(props.path),
    hasGhosts: Boolean(props.ghosts),
    onToggle: toggle,
  }
  const menus = useMenuHandlers((at) =>
    openMenu(scene.name, at, [...(entries?.() ?? []), ...armEntries(camera.current, tools)]),
  )
  if (!hasWebGlSupport)
    return (
      <StaticArm name={scene.name} drawing={drawing} state={drawn ?? noState}>
        {children}
      </StaticArm>
    )
  return (
    <div className="robot">
      <div
        className="stage"
        role="application"
        aria-label={`The robot ${scene.name}. ${KEY_HELP}`}
        tabIndex={0}
        onKeyDown={(event) => handleKey(event, camera.current, props.onKey)}
        {...menus}
      >
        <Canvas
          shadows="percentage"
          frameloop="demand"
          dpr={[1, 2]}
          camera={{
            position: [1.6 * scene.reach, -1.9 * scene.reach, 1.35 * scene.reach],
            up: [0, 0, 1],
            fov: 32,
            near: 0.02 * scene.reach,
            far: 60 * scene.reach,
          }}
          aria-hidden
        >
          <StageContents {...props} scheme={scheme} camera={camera} rendering={rendering} />
        </Canvas>
      </div>
      <ViewTools
        camera={camera}
        playForVideo={playForVideo && (() => playForVideo())}
        rendering={rendering}
        name={scene.name}
        {...tools}
      >
        {children}
      </ViewTools>
      <ToolPosition poses={poses} rows={scene.rows} state={state} />
    </div>
  )
}

/** Keys of the view: first the keys of the caller, then the keys of the camera. */
function handleKey(event: React.KeyboardEvent, view: CameraHandle | null, onKey: StageProps['onKey']): void {
  if (!onKey?.(event) && !moveCamera(event, view)) return
  event.preventDefault()
  event.stopPropagation()
}

/** Move the camera by a key; returns whether it is a key of the camera. */
function moveCamera(event: React.KeyboardEvent, view: CameraHandle | null): boolean {
  if (!view || event.ctrlKey || event.metaKey || event.altKey) return false
  const turns: Record<string, [number, number]> = {
    ArrowLeft: [-TURN, 0],
    ArrowRight: [TURN, 0],
    ArrowUp: [0, -TURN],
    ArrowDown: [0, TURN],
  }
  const turn = turns[event.key]
  if (turn) view.turn(...turn)
  else if (event.key === '+' || event.key === '=') view.zoom(0.85)
  else if (event.key === '-') view.zoom(1 / 0.85)
  else if (event.key === 'Home') view.look('iso')
  else if (event.key === ' ') view.fit()
  else return false
  return true
}

interface StageContentsProps extends StageProps {
  scheme: 'light' | 'dark'
  camera: React.RefObject<CameraHandle | null>
  rendering: React.RefObject<Rendering | null>
}

function StageContents({
  scene,
  poses,
  state,
  path,
  ghosts,
  extent,
  extentKey,
  contents,
  pedestal = true,
  scheme,
  camera,
  rendering,
}: StageContentsProps) {
  const options = useViewOptions()
  const bodies = useBodies(scene)
  const colours = COLOURS[scheme]
  const dark = scheme === 'dark'
  const { reach } = scene
  const footHeight = (poses()?.(0, 11) ?? 0) - scene.foot
  const floor = useFloor(scene, poses, footHeight, extent, extentKey)
  useRenderOnChange(state)
  const invalidate = useThree((s) => s.invalidate)
  useEffect(() => invalidate(), [options, bodies, scheme, contents, invalidate])
  const gl = useThree((s) => s.gl)
  const world = useThree((s) => s.scene)
  const eye = useThree((s) => s.camera)
  useEffect(() => {
    rendering.current = { gl, draw: () => gl.render(world, eye) }
    return () => void (rendering.current = null)
  }, [gl, world, eye, rendering])
  const overlay = { scene, poses, dark }
  return (
    <>
      <color attach="background" args={[colours.background]} />
      <Surroundings dark={dark} />
      <directionalLight
        position={[1.9 * reach, -1.4 * reach, 3.4 * reach]}
        intensity={dark ? 1.9 : 2.1}
        castShadow
        shadow-mapSize={[1024, 1024]}
        shadow-radius={5}
        shadow-camera-left={-1.5 * reach}
        shadow-camera-right={1.5 * reach}
        shadow-camera-top={1.5 * reach}
        shadow-camera-bottom={-1.5 * reach}
        shadow-camera-far={9 * reach}
        shadow-normalBias={0.006 * reach}
        shadow-bias={-0.0004}
      />
      <directionalLight
        position={[-2.4 * reach, 1.8 * reach, 1.6 * reach]}
        intensity={0.55}
        color="#dfe8f5"
      />
      <Arm scene={scene} bodies={bodies} poses={poses} />
      {options.ghosts && ghosts && (
        <Arm scene={scene} bodies={bodies} poses={ghosts.start} ghost={colours.start} />
      )}
      {options.ghosts && ghosts && (
        <Arm scene={scene} bodies={bodies} poses={ghosts.goal} ghost={colours.goal} />
      )}
      {options.frames && <Frames {...overlay} />}
      {options.axes && <JointAxes {...overlay} />}
      {options.limits && <Limits {...overlay} />}
      {options.path && path && <ToolPath path={path} dark={dark} background={colours.background} />}
      {contents}
      {pedestal && <Pedestal from={floor} to={footHeight} reach={reach} poses={poses} />}
      <Ground height={floor} reach={reach} colours={colours} />
      <ViewCamera
        scene={scene}
        poses={poses}
        floor={floor}
        extent={extent}
        extentKey={extentKey}
        handle={camera}
      />
    </>
  )
}

/** The environment map of reflections: created once for each colour scheme, because its rendering is slow. */
const Surroundings = memo(function Surroundings({ dark }: { dark: boolean }) {
  return (
    <Environment resolution={64} environmentIntensity={dark ? 0.42 : 0.6}>
      <color attach="background" args={[dark ? '#39424d' : '#b9b4ad']} />
      <Lightformer
        form="rect"
        intensity={3.2}
        color="#fff6ec"
        position={[3, -4, 6]}
        scale={[6, 4, 1]}
        target={[0, 0, 0]}
      />
      <Lightformer
        form="rect"
        intensity={1.2}
        color="#dfe8f5"
        position={[-6, 3, 3]}
        scale={[5, 6, 1]}
        target={[0, 0, 0]}
      />
      <Lightformer
        form="rect"
        intensity={1.6}
        color="#ffffff"
        position={[0, 6, 4]}
        scale={[8, 1, 1]}
        target={[0, 0, 0]}
      />
    </Environment>
  )
})

/**
 * The height of the floor, m: at the foot of the arm, or below all positions reached, if the arm has reached
 * below its foot.
 */
function useFloor(
  scene: RobotScene,
  poses: () => Poses | undefined,
  footHeight: number,
  extent: StageProps['extent'],
  extentKey: string | undefined,
): number {
  const [lowestFloor, setLowestFloor] = useState<{ name: string; floor: number }>({
    name: scene.name,
    floor: Infinity,
  })
  const lastExtentKey = useRef('')
  const step = (scene.reach > 1 ? 0.5 : 0.1) * Math.max(1, Math.round(0.12 * scene.reach))
  useFrame(() => {
    const now = poses()
    if (!now) return
    let low = Infinity
    for (let row = 1; row < scene.rows; row++) low = Math.min(low, now(row, 11))
    if (extentKey && extentKey !== lastExtentKey.current) {
      lastExtentKey.current = extentKey
      for (const [, , z] of extent?.() ?? []) low = Math.min(low, z)
    }
    low -= 0.06 * scene.reach
    const floor = low < footHeight ? step * Math.floor(low / step) : Infinity
    const lower = (previous: typeof lowestFloor) =>
      previous.name !== scene.name || floor < previous.floor - 1e-9
    // Several frames may come before the state changes; a later frame does not raise the floor again.
    if (lower(lowestFloor)) setLowestFloor((before) => (lower(before) ? { name: scene.name, floor } : before))
  })
  return lowestFloor.name === scene.name ? Math.min(footHeight, lowestFloor.floor) : footHeight
}

/** A column below the foot of an arm that reaches below its foot. */
function Pedestal({
  from,
  to,
  reach,
  poses,
}: {
  from: number
  to: number
  reach: number
  poses: () => Poses | undefined
}) {
  const now = poses()
  if (to - from < 0.01 * reach || !now || now(0, 10) < 0.7) return null
  const radius = 0.06 * reach
  const quarterTurn = Math.PI / 2
  return (
    <group position={[now(0, 3), now(0, 7), 0]}>
      <mesh position={[0, 0, (from + to) / 2]} rotation={[quarterTurn, 0, 0]} castShadow receiveShadow>
        <cylinderGeometry args={[1.25 * radius, 1.4 * radius, to - from, 40]} />
        <meshStandardMaterial {...MATERIALS.base} />
      </mesh>
      <mesh position={[0, 0, from + 0.08 * radius]} rotation={[quarterTurn, 0, 0]} castShadow receiveShadow>
        <cylinderGeometry args={[2.1 * radius, 2.2 * radius, 0.16 * radius, 48]} />
        <meshStandardMaterial {...MATERIALS.base} />
      </mesh>
    </group>
  )
}

/** Renders a frame only if something has moved. */
function useRenderOnChange(state: () => string): void {
  const invalidate = useThree((s) => s.invalidate)
  useEffect(() => {
    let lastState = ''
    return onFrame(() => {
      const now = state()
      if (now === lastState) return
      lastState = now
      invalidate()
    })
  }, [state, invalidate])
}

function Ground({
  height,
  reach,
  colours,
}: {
  height: number
  reach: number
  colours: (typeof COLOURS)['light']
}) {
  return (
    <>
      {/* The shadow writes no depth: the lines above it are too close for the depth buffer. */}
      <mesh position={[0, 0, height - 0.001 * reach]} renderOrder={-2} receiveShadow>
        <planeGeometry args={[12 * reach, 12 * reach]} />
        <shadowMaterial opacity={colours.shadow} depthWrite={false} />
      </mesh>
      <Grid
        key={colours.cell}
        position={[0, 0, height]}
        rotation={[Math.PI / 2, 0, 0]}
        renderOrder={-1}
        args={[12 * reach, 12 * reach]}
        cellSize={reach > 1 ? 0.25 : 0.1}
        cellThickness={0.7}
        sectionSize={reach > 1 ? 1 : 0.5}
        sectionThickness={1.1}
        cellColor={colours.cell}
        sectionColor={colours.section}
        // The size depends on the arm, not on the distance of the camera.
        fadeFrom={0}
        fadeDistance={6 * reach}
        fadeStrength={1.2}
      />
    </>
  )
}

/** The position of the tool, in a corner of the view. */
function ToolPosition({
  poses,
  rows,
  state,
}: {
  poses: () => Poses | undefined
  rows: number
  state: () => string
}) {
  const text = useRef<HTMLOutputElement>(null)
  useEffect(() => {
    let lastState = ''
    return onFrame(() => {
      const key = state()
      if (key === lastState || !text.current) return
      lastState = key
      const now = poses()
      text.current.textContent = now
        ? [3, 7, 11].map((k, axis) => `${'xyz'[axis]} ${metres(now(rows - 1, k))}`).join('   ') + ' m'
        : ''
    })
  }, [poses, rows, state])
  return <output ref={text} className="instant numbers" aria-label="Position of the tool" />
}

/** A coordinate with three decimals, and no sign before zero. */
const metres = (value: number) => (Math.round(1000 * value) / 1000 + 0).toFixed(3).replace('-', '−')

function hasWebGl(): boolean {
  try {
    return Boolean(document.createElement('canvas').getContext('webgl2'))
  } catch {
    return false
  }
}
