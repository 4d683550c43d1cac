import { useCallback, useState } from 'react'
import { JointSlider } from '../robot/joint_slider'
import { posesForScene, type RobotScene } from '../robot/scene'
import { Stage } from '../robot/stage'
import { moveJoint, useJoints, type SliderOfJoint } from './joints'

interface PosedArmProps {
  scene: RobotScene
  sliders: SliderOfJoint[]
  drawing: () => Promise<string | undefined>
}

const state = () => String(useJoints.getState().count)

/** The arm at the coordinates of its sliders. */
export function PosedArm({ scene, sliders, drawing }: PosedArmProps) {
  const poses = useCallback(() => posesForScene(scene, useJoints.getState().poses), [scene])
  return (
    <div className="posed-arm">
      <Stage scene={scene} poses={poses} state={state} drawing={drawing} />
      <Sliders sliders={sliders} />
    </div>
  )
}

function Sliders({ sliders }: { sliders: SliderOfJoint[] }) {
  const q = useJoints((s) => s.q)
  const live = useJoints((s) => s.live)
  const [home] = useState(q)
  return (
    <section className="joints-panel" aria-label="Joints">
      {sliders.map(({ name, unit, low, high }, k) => {
        const factor = unit === 'rad' ? 180 / Math.PI : 1
        const value = q[k] ?? home[k] ?? 0
        return (
          <JointSlider
            key={name}
            name={name}
            label={name}
            low={low}
            high={high}
            value={value}
            text={String(Number((value * factor).toFixed(3)))}
            unit={unit === 'rad' ? '°' : unit}
            disabled={!live}
            onValue={(moved) => moveJoint(k, moved)}
            onNumber={(typed) => moveJoint(k, typed / factor)}
          />
        )
      })}
      {!live && <p className="note">The Python program has ended. The view can still be turned.</p>}
    </section>
  )
}
