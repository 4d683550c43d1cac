import { useComputedColorScheme } from '@mantine/core'
import { useCallback, useEffect, useRef, useState } from 'react'
import { Refusal } from '../../connection'
import { scheduleFrame } from '../../frames'
import { ask, connection } from '../../store'
import { posesForScene, type Poses, type RobotScene } from '../scene'
import { Stage } from '../stage'
import { dragTo, jog, useTeaching } from '../teach/state'
import { ToolHandle, Workspace } from '../teach/tool_handle'
import type { ToolPathPoints } from '../tool_path'
import { posesOf, useRobotEditor } from './state'

/** The robot of the editor, at the joint positions of its sliders, with a handle at its tool. */
export default function ArmPanel() {
  const current = useRobotEditor((s) => s.current)
  const version = useRobotEditor((s) => (s.current ? s.robots[s.current]?.state.version : undefined))
  const { scene, poses, state } = useRobotPoses(current, version)
  const drawing = useCallback(async () => {
    const { joints } = useRobotEditor.getState()
    const theme = document.documentElement.dataset['mantineColorScheme'] === 'dark' ? 'dark' : 'light'
    return current
      ? ask({ kind: 'picture', document: current, q: joints[current]?.q ?? [], theme })
      : undefined
  }, [current])
  const hasMotion = useTeaching((s) => s.motion !== null)
  const contents = useContents(scene, poses)
  if (!scene) return <p className="empty">Loading the robot …</p>
  return (
    <Stage
      key={current}
      scene={scene}
      poses={poses}
      state={state}
      drawing={drawing}
      drawn={state}
      contents={contents}
      onKey={(event) => moveByKey(event, poses(), scene.rows - 1)}
      {...(hasMotion ? { path: motionPath } : {})}
    />
  )
}

/** The scene of a robot, and its poses at the joint positions of the editor; `state` changes with them. */
function useRobotPoses(current: string | null, version: number | undefined) {
  const [scene, setScene] = useState<RobotScene | null>(null)
  const shownPoses = useRef<number[][][]>(undefined)
  const count = useRef(0)
  useEffect(() => {
    if (!current || version === undefined) return
    let mounted = true
    let busy = false
    let outdated = true
    const show = (shown: number[][][]) => {
      shownPoses.current = shown
      count.current++
      scheduleFrame()
    }
    // While a request is pending, only the latest of the later configurations is requested.
    const updatePoses = async () => {
      const known = posesOf(useRobotEditor.getState().joints[current]?.q ?? [])
      if (known) {
        outdated = false
        return show(known)
      }
      outdated = true
      if (busy) return
      busy = true
      while (outdated && mounted) {
        outdated = false
        const q = useRobotEditor.getState().joints[current]?.q
        if (!q) break
        try {
          const reply = await connection.ask({ kind: 'pose', document: current, q })
          if (!mounted) break
          // Meanwhile the arm may have been moved to a configuration with known poses.
          if (!posesOf(useRobotEditor.getState().joints[current]?.q ?? [])) show(reply)
        } catch (error) {
          if (!(error instanceof Refusal)) throw error
        }
      }
      busy = false
    }
    void updatePoses()
    void ask({ kind: 'scene', document: current }).then((reply) => {
      if (mounted && reply) setScene(reply)
    })
    const unsubscribe = useRobotEditor.subscribe((now, before) => {
      if (now.joints[current] !== before.joints[current]) void updatePoses()
    })
    return () => {
      mounted = false
      unsubscribe()
    }
  }, [current, version])
  const poses = useCallback(() => posesForScene(scene, shownPoses.current), [scene])
  const state = useCallback(() => `${current} ${count.current}`, [current])
  return { scene, poses, state }
}

/** The handle of the tool and the workspace, where they are shown. */
function useContents(scene: RobotScene | null, poses: () => Poses | undefined): React.ReactNode {
  const { handle, axes, workspace } = useTeaching()
  const dark = useComputedColorScheme('light') === 'dark'
  if (!scene) return null
  return (
    <>
      {handle !== 'off' && (
        <ToolHandle poses={poses} row={scene.rows - 1} mode={handle} axes={axes} onDrag={dragTo} />
      )}
      {workspace && <Workspace points={workspace.points} size={0.006 * scene.reach} dark={dark} />}
    </>
  )
}

/** Keys of the view that move the tool by one step; without them the arrows turn the view. */
const TOOL_KEYS: Record<string, [direction: number, sign: number]> = {
  ArrowRight: [0, 1],
  ArrowLeft: [0, -1],
  ArrowUp: [1, 1],
  ArrowDown: [1, -1],
  PageUp: [2, 1],
  PageDown: [2, -1],
}

/** Move the tool with Shift and a key; with Alt as well, turn it. */
function moveByKey(event: React.KeyboardEvent, poses: Poses | undefined, row: number): boolean {
  const motion = event.shiftKey && !event.ctrlKey && !event.metaKey ? TOOL_KEYS[event.key] : undefined
  if (!motion || !poses) return false
  const tool = Array.from({ length: 16 }, (_, k) => poses(row, k))
  jog(tool, event.altKey ? motion[0] + 3 : motion[0], motion[1])
  return true
}

/** The path of the tool in the planned motion, up to the shown time. */
function motionPath(): ToolPathPoints | undefined {
  const { motion, time } = useTeaching.getState()
  if (!motion) return undefined
  const last = motion.frames.indexAt(time)
  return {
    key: `${motion.document} ${motion.version} ${motion.course} ${last}`,
    last,
    point: (k) => motion.frames.tool(k),
  }
}
