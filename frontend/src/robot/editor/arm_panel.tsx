import { useCallback, useEffect, useRef, useState } from 'react'
import { Refusal } from '../../connection'
import { scheduleFrame } from '../../frames'
import { ask, connection } from '../../store'
import { posesForScene, type RobotScene } from '../scene'
import { Stage } from '../stage'
import { useRobotEditor } from './state'

/** The robot of the editor, at the joint positions of its sliders. */
export default function ArmPanel() {
  const current = useRobotEditor((s) => s.current)
  const robot = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const [scene, setScene] = useState<RobotScene | null>(null)
  const poses = useRef<number[][][]>(undefined)
  const poseCount = useRef(0)
  const version = robot?.state.version

  useEffect(() => {
    if (!current || version === undefined) return
    let mounted = true
    let busy = false
    let outdated = true
    // While a request is pending, only the latest of the later configurations is requested.
    const updatePoses = async () => {
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
          poses.current = reply
          poseCount.current++
          scheduleFrame()
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

  const matchingPoses = useCallback(() => posesForScene(scene, poses.current), [scene])
  const state = useCallback(() => `${current} ${poseCount.current}`, [current])
  const drawing = useCallback(async () => {
    const { joints } = useRobotEditor.getState()
    const theme = document.documentElement.dataset['mantineColorScheme'] === 'dark' ? 'dark' : 'light'
    return current
      ? ask({ kind: 'picture', document: current, q: joints[current]?.q ?? [], theme })
      : undefined
  }, [current])
  if (!scene) return <p className="empty">Loading the robot …</p>
  return (
    <Stage key={current} scene={scene} poses={matchingPoses} state={state} drawing={drawing} drawn={state} />
  )
}
