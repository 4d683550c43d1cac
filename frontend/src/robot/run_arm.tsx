import { useCallback, useMemo, useRef } from 'react'
import type { Entries } from '../context_menu_state'
import { play, shownTime, useCursor } from '../run/cursor'
import { samples } from '../samples'
import { useStudio } from '../store'
import type { Poses, RobotScene } from './scene'
import { Stage, type Ghosts } from './stage'
import type { ToolPathPoints } from './tool_path'

interface RunArmProps {
  /** The block whose recorded poses move the arm. */
  path: string
  scene: RobotScene
  /** The pose of the arm without recorded samples. */
  rest: Poses
  /** The drawing for browsers without WebGL. */
  drawing: () => Promise<string | undefined>
  /** Additional entries at the start of the context menu. */
  entries?: () => Entries
  /** Whether an arm that reaches below its foot stands on a column. */
  pedestal?: boolean
  /** Additional buttons before the usual buttons. */
  children?: React.ReactNode
}

/** The arm in the pose of the run at the time cursor. */
export function RunArm({ path, scene, rest, drawing, pedestal = true, children, entries }: RunArmProps) {
  const extentKey = useStudio((s) => (s.run?.state === 'done' ? s.run.run : ''))
  const hasPoses = useStudio((s) =>
    Boolean(s.run?.views.some((view) => view.kind === 'robot' && view.block === path)),
  )
  const poses = useCallback(
    () => posesAt(path, scene.rows, samples.indexAt(shownTime())) ?? rest,
    [path, scene.rows, rest],
  )
  const lastState = useRef('')
  const state = useCallback(() => {
    // A run that has started but sent no samples does not move the arm: the samples arrive before the next
    // picture is drawn.
    if (samples.count || !samples.run) lastState.current = `${samples.run} ${samples.version} ${shownTime()}`
    return lastState.current
  }, [])
  const toolPath = useCallback((): ToolPathPoints | undefined => {
    const columns = poseSignal(path, scene.rows)
    const last = samples.indexAt(shownTime())
    if (!columns || last < 0) return undefined
    const tool = 16 * (scene.rows - 1)
    return {
      key: `${samples.run} ${samples.version} ${last}`,
      last,
      point: (k) => [columns[tool + 3]![k]!, columns[tool + 7]![k]!, columns[tool + 11]![k]!],
    }
  }, [path, scene.rows])
  const ghosts = useMemo<Ghosts>(
    () => ({
      // A ghost at the pose of the arm itself is hidden.
      start: () => (samples.indexAt(shownTime()) > 0 ? posesAt(path, scene.rows, 0) : undefined),
      goal: () =>
        useStudio.getState().run?.state === 'done' && samples.indexAt(shownTime()) < samples.count - 1
          ? posesAt(path, scene.rows, samples.count - 1)
          : undefined,
    }),
    [path, scene.rows],
  )
  const extent = useCallback(() => extentOf(path, scene.rows), [path, scene.rows])
  return (
    <Stage
      scene={scene}
      poses={poses}
      state={state}
      path={toolPath}
      ghosts={ghosts}
      extent={extent}
      extentKey={extentKey}
      drawing={drawing}
      pedestal={pedestal}
      {...(hasPoses ? { playForVideo: playFromStart } : {})}
      {...(entries ? { entries } : {})}
    >
      {children}
    </Stage>
  )
}

/** The columns of the poses that a run has recorded for a block. */
function poseSignal(path: string, rows: number): Float64Array[] | undefined {
  const { run } = useStudio.getState()
  const view = run?.views.find((candidate) => candidate.kind === 'robot' && candidate.block === path)
  const columns = view && samples.signal(`${path}/${view.signals[0]}`)
  return columns?.columns.length === 16 * rows ? columns.columns : undefined
}

function posesAt(path: string, rows: number, index: number): Poses | undefined {
  const columns = index < 0 ? undefined : poseSignal(path, rows)
  return columns && index < (columns[0]?.length ?? 0) ? (row, k) => columns[16 * row + k]![index]! : undefined
}

const EXTENT_SAMPLES = 60

/** Poses of the links at times distributed over the whole run. */
function extentOf(path: string, rows: number): [number, number, number][] {
  const columns = poseSignal(path, rows)
  if (!columns || !samples.count) return []
  const points: [number, number, number][] = []
  const last = samples.count - 1
  for (let k = 0; k <= EXTENT_SAMPLES; k++) {
    const index = Math.round((last * k) / EXTENT_SAMPLES)
    for (let row = 0; row < rows; row++)
      points.push([3, 7, 11].map((entry) => columns[16 * row + entry]![index]!) as [number, number, number])
  }
  return points
}

/** Play the run from its start; resolves at its end or when it is paused. */
function playFromStart(): Promise<void> {
  useCursor.setState({ time: samples.time[0] ?? 0, playing: false, loop: false })
  play()
  return new Promise((resolve) => {
    const stop = useCursor.subscribe(({ playing }) => {
      if (playing) return
      stop()
      resolve()
    })
  })
}
