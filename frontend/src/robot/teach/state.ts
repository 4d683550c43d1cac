import { create } from 'zustand'
import { Refusal } from '../../connection'
import { onFrame, scheduleFrame } from '../../frames'
import { MotionPoses } from '../../model/motion'
import { unpackedFloats } from '../../model/packed'
import { moved, type Axes, type PoseMatrix } from '../../model/tool_pose'
import type { PlannedMotion } from '../../protocol'
import { ask, connection } from '../../store'
import { edit, setJoints, setJointsWithPoses, useRobotEditor, type OpenRobot } from '../editor/state'

export type Course = 'joint' | 'line' | 'spline'

/** A planned motion of one robot, in one version of its document. */
export interface ShownMotion extends PlannedMotion {
  document: string
  version: number
  course: Course
  frames: MotionPoses
}

interface Teaching {
  /** The handle at the tool: none, arrows or rings. */
  handle: 'off' | 'translate' | 'rotate'
  axes: Axes
  /** Steps of the keys and buttons, m and rad. */
  step: number
  turn: number
  /** Whether the tool is on the way to a target. */
  moving: boolean
  /** Why the tool did not reach its last target; empty if it did. */
  why: string
  /** The directions that the joints cannot follow. */
  missing: string[]
  /** Names of poses that the motion omits, by the keys of the documents. */
  omitted: Record<string, string[]>
  course: Course
  /** The typed duration, s; empty for the shortest duration. */
  duration: string
  motion: ShownMotion | null
  fault: string
  time: number
  playing: boolean
  /** Positions that the tool reaches, as x, y, z. */
  workspace: { document: string; version: number; points: Float32Array } | null
  /** The file name in the dialog that saves the motion; null while it is closed. */
  saving: string | null
  refusal: string
}

export const useTeaching = create<Teaching>(() => ({
  handle: 'off',
  axes: 'world',
  step: 0.01,
  turn: Math.PI / 36,
  moving: false,
  why: '',
  missing: [],
  omitted: {},
  course: 'joint',
  duration: '',
  motion: null,
  fault: '',
  time: 0,
  playing: false,
  workspace: null,
  saving: null,
  refusal: '',
}))

const shownRobot = () => {
  const { current, robots, joints } = useRobotEditor.getState()
  const robot = current ? robots[current] : undefined
  const shown = current ? joints[current] : undefined
  return robot && shown ? { robot, q: shown.q, document: robot.state.document } : undefined
}

/** Whether the editor still shows this version of this robot, after a reply of the server. */
function isShown(document: string, version: number): boolean {
  const { current, robots } = useRobotEditor.getState()
  return current === document && robots[document]?.state.version === version
}

/** At first, the motion omits the named configurations of a shipped robot. */
function omitPublishedPoses(): void {
  const { robots, current } = useRobotEditor.getState()
  const robot = current ? robots[current] : undefined
  const { omitted } = useTeaching.getState()
  if (!current || !robot || omitted[current]) return
  useTeaching.setState({ omitted: { ...omitted, [current]: robot.published_poses } })
}
omitPublishedPoses() // the robot is shown before this part of the page is loaded

/** A motion or a workspace belongs to one version of one robot. */
useRobotEditor.subscribe(({ robots, current }, before) => {
  if (robots === before.robots && current === before.current) return
  omitPublishedPoses()
  const version = current ? robots[current]?.state.version : undefined
  const isPresent = (one: { document: string; version: number } | null) =>
    one?.document === current && one?.version === version
  const { motion, workspace } = useTeaching.getState()
  if (motion && !isPresent(motion)) useTeaching.setState({ motion: null, playing: false, time: 0 })
  if (workspace && !isPresent(workspace)) useTeaching.setState({ workspace: null })
  if (current !== before.current) useTeaching.setState({ why: '', missing: [], fault: '' })
})

// -- the tool ----------------------------------------------------------------------------------------------

/** The next pose to be requested. */
let target: PoseMatrix | null = null
/** The pose of the tool that was requested last, or reached with the coordinates `q`. */
let latest: { pose: PoseMatrix; q: number[] | null } | null = null

/** Move the tool toward a pose. While a request is pending, only the latest of the later poses is sent. */
export function dragTo(pose: PoseMatrix): void {
  target = pose
  latest = { pose, q: null }
  pausePlayback()
  if (useTeaching.getState().moving) return
  useTeaching.setState({ moving: true })
  void follow().finally(() => useTeaching.setState({ moving: false }))
}

async function follow(): Promise<void> {
  while (target) {
    const pose = target
    target = null
    const shown = shownRobot()
    if (!shown) break
    try {
      const reply = await connection.ask({
        kind: 'reach',
        document: shown.document,
        q: shown.q,
        target: pose,
      })
      if (useRobotEditor.getState().current !== shown.document) break
      setJointsWithPoses({ q: reply.q }, reply.poses)
      if (!target) latest = { pose: reply.tool, q: reply.q }
      useTeaching.setState({ why: reply.why, missing: reply.missing })
    } catch (error) {
      if (!(error instanceof Refusal)) throw error
      useTeaching.setState({ why: error.what })
    }
  }
}

/**
 * Move or turn the tool by one step in a direction (see `moved`).
 * `tool`: its displayed pose, which may be older than the latest movement.
 */
export function jog(tool: PoseMatrix, direction: number, sign: number): void {
  const { axes, step, turn, moving } = useTeaching.getState()
  const isLatest = latest && (moving || latest.q === shownRobot()?.q)
  const start = latest && isLatest ? latest.pose : tool
  dragTo(moved(start, direction, sign * (direction < 3 ? step : turn), axes))
}

// -- poses -------------------------------------------------------------------------------------------------

/** Add the present configuration to the list of poses. */
export function recordPose(): void {
  const shown = shownRobot()
  if (shown) void edit({ kind: 'record_pose', q: shown.q })
}

/** Replace a pose by the present configuration. */
export function updatePose(name: string): void {
  const shown = shownRobot()
  if (shown) void edit({ kind: 'update_pose', name, q: shown.q })
}

/** Show the arm in a recorded pose. */
export function goTo(q: number[]): void {
  pausePlayback()
  useTeaching.setState({ why: '' })
  setJoints({ q: [...q] })
}

/** Rename a pose; the motion passes or omits it as before. */
export async function renamePose(name: string, to: string): Promise<Refusal | undefined> {
  const document = shownRobot()?.document
  const fault = await edit({ kind: 'rename_pose', name, to })
  const { omitted } = useTeaching.getState()
  const names = document && omitted[document]
  if (!fault && names)
    useTeaching.setState({
      omitted: { ...omitted, [document]: names.map((one) => (one === name ? to : one)) },
    })
  return fault
}

/** Let the motion pass or omit a pose; the present motion no longer applies. */
export function passPose(name: string, isPassed: boolean): void {
  const document = shownRobot()?.document
  if (!document) return
  const { omitted } = useTeaching.getState()
  const others = (omitted[document] ?? []).filter((one) => one !== name)
  useTeaching.setState({ omitted: { ...omitted, [document]: isPassed ? others : [...others, name] } })
  chooseMotion({})
}

/** Names of the poses that the motion passes, in their order. */
export function usePassedPoses(): string[] {
  const robot = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const omitted = useTeaching((s) => robot && s.omitted[robot.state.document])
  return robot ? passed(robot, omitted) : []
}

function passed(robot: OpenRobot, omitted: string[] = []): string[] {
  return robot.poses.map(({ name }) => name).filter((name) => !omitted.includes(name))
}

// -- the motion --------------------------------------------------------------------------------------------

/** The typed duration: null for the shortest duration, undefined if it is not valid. */
function typedDuration(): number | null | undefined {
  const text = useTeaching.getState().duration.trim()
  if (!text) return null
  const value = Number(text.replace(',', '.'))
  return value >= 0.001 && value <= 3600 ? value : undefined
}

function motionChoice() {
  const shown = shownRobot()
  const duration = typedDuration()
  if (!shown) return undefined
  if (duration === undefined) {
    useTeaching.setState({ fault: 'The duration is not a number of seconds from 0.001 to 3600.' })
    return undefined
  }
  const { course, omitted } = useTeaching.getState()
  const { document, robot } = shown
  return { document, poses: passed(robot, omitted[document]), course, duration }
}

/** Choose the course or the duration; the present motion no longer applies. */
export function chooseMotion(choice: Partial<Pick<Teaching, 'course' | 'duration'>>): void {
  useTeaching.setState({ ...choice, motion: null, playing: false, fault: '', time: 0 })
}

/** Plan the motion through the chosen poses and play it. */
export async function runMotion(): Promise<void> {
  const shown = shownRobot()
  const choice = motionChoice()
  if (!shown || !choice) return
  const { version } = shown.robot.state
  const { course, duration, omitted } = useTeaching.getState()
  const isCurrent = () => {
    const now = useTeaching.getState()
    const isChosen = now.course === course && now.duration === duration && now.omitted === omitted
    return isChosen && isShown(shown.document, version)
  }
  try {
    const motion = await connection.ask({ kind: 'motion', ...choice })
    if (!isCurrent()) return
    const frames = new MotionPoses(motion)
    const planned = { ...motion, frames, course: choice.course, document: shown.document, version }
    useTeaching.setState({ motion: planned, fault: '', time: 0, playing: true })
    showTime(0)
    scheduleFrame()
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    if (!isCurrent()) return
    useTeaching.setState({ motion: null, playing: false, fault: `${error.what}. ${error.fix}.` })
  }
}

/** Show the arm at a time of the motion, s. */
export function showTime(time: number): void {
  const { motion } = useTeaching.getState()
  if (!motion) return
  const index = motion.frames.indexAt(time)
  useTeaching.setState({ time, why: '' })
  setJointsWithPoses(
    { q: motion.q[index]!, qd: motion.qd[index]!, qdd: motion.qdd[index]! },
    motion.frames.at(index),
  )
}

/** Play from the shown time, or from the start if the motion has ended. */
export function playMotion(): void {
  const { motion, time } = useTeaching.getState()
  if (!motion) return
  const end = motion.time.at(-1)!
  if (time >= end) showTime(0)
  useTeaching.setState({ playing: true })
  scheduleFrame()
}

export function pausePlayback(): void {
  if (useTeaching.getState().playing) useTeaching.setState({ playing: false })
}

/** The frame (ms) in which the playback was last advanced; null without playback. */
let lastFrame: number | null = null

onFrame((now) => {
  const { playing, time, motion } = useTeaching.getState()
  if (playing && motion && lastFrame !== null) {
    const end = motion.time.at(-1)!
    const next = Math.min(end, time + (now - lastFrame) / 1000)
    showTime(next)
    if (next >= end) useTeaching.setState({ playing: false })
  }
  lastFrame = playing ? now : null
  if (playing) scheduleFrame()
})

/** The rows of a Trajectory block that plays the motion. */
export async function motionRows(): Promise<number[][] | undefined> {
  const choice = motionChoice()
  return choice && (await ask({ kind: 'motion_rows', ...choice }))
}

/** Write the motion as a trajectory file. */
export async function saveMotion(path: string, overwrite: boolean): Promise<void> {
  const choice = motionChoice()
  if (!choice) return
  try {
    await connection.ask({ kind: 'save_motion', ...choice, path, overwrite })
    useTeaching.setState({ saving: null, refusal: '' })
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    useTeaching.setState({ refusal: error.what })
  }
}

// -- the workspace -----------------------------------------------------------------------------------------

/** Show or hide the positions that the tool reaches. */
export async function toggleWorkspace(): Promise<void> {
  if (useTeaching.getState().workspace) return useTeaching.setState({ workspace: null })
  const shown = shownRobot()
  if (!shown) return
  const { document, version } = shown.robot.state
  const packed = await ask({ kind: 'workspace', document })
  if (!packed || !isShown(document, version)) return
  useTeaching.setState({ workspace: { document, version, points: unpackedFloats(packed) } })
}
