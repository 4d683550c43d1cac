import { useCallback, useEffect, useRef, useState } from 'react'
import { Refusal } from '../../connection'
import { changed } from '../../frames'
import { ask, line } from '../../store'
import { fitting, type RobotScene } from '../scene'
import { Stage } from '../stage'
import { useDesk } from './desk'

/** The robot of the editor, at the joint positions of its sliders. */
export default function ArmPanel() {
  const current = useDesk((s) => s.current)
  const shown = useDesk((s) => (s.current ? s.robots[s.current] : undefined))
  const [scene, setScene] = useState<RobotScene | null>(null)
  const poses = useRef<number[][][]>(undefined)
  const moves = useRef(0)
  const version = shown?.state.version

  useEffect(() => {
    if (!current || version === undefined) return
    let alive = true
    let under = false
    let wanted = true
    // While a request is pending, only the latest of the later configurations is requested.
    const move = async () => {
      wanted = true
      if (under) return
      under = true
      while (wanted && alive) {
        wanted = false
        const q = useDesk.getState().joints[current]?.q
        if (!q) break
        try {
          const found = await line.ask({ kind: 'pose', document: current, q })
          if (!alive) break
          poses.current = found
          moves.current++
          changed()
        } catch (error) {
          if (!(error instanceof Refusal)) throw error
        }
      }
      under = false
    }
    void move()
    void ask({ kind: 'scene', document: current }).then((found) => {
      if (alive && found) setScene(found)
    })
    const leave = useDesk.subscribe((now, before) => {
      if (now.joints[current] !== before.joints[current]) void move()
    })
    return () => {
      alive = false
      leave()
    }
  }, [current, version])

  const posesNow = useCallback(() => fitting(scene, poses.current), [scene])
  const state = useCallback(() => `${current} ${moves.current}`, [current])
  const drawing = useCallback(async () => {
    const { joints } = useDesk.getState()
    const theme = document.documentElement.dataset['mantineColorScheme'] === 'dark' ? 'dark' : 'light'
    return current
      ? ask({ kind: 'picture', document: current, q: joints[current]?.q ?? [], theme })
      : undefined
  }, [current])
  if (!scene) return <p className="empty">Loading the robot …</p>
  return <Stage key={current} scene={scene} poses={posesNow} state={state} drawing={drawing} drawn={state} />
}
