import { Button, SegmentedControl } from '@mantine/core'
import { useState } from 'react'
import type { LinkRow } from '../../protocol'
import { JointSlider } from '../joint_slider'
import { atRest, cellText, setJoints, useRobotEditor, type Joints } from './state'

const HALF_TURN = Math.PI
/** Range of a prismatic joint without limits, m. */
const DEFAULT_RANGE = 1

/** The displayed quantity of the joints: position, speed, acceleration. */
const QUANTITIES = [
  { value: 'q', label: 'q' },
  { value: 'qd', label: 'qd' },
  { value: 'qdd', label: 'qdd' },
]

/** A slider for each joint within its range, and fields for speeds and accelerations. */
export function JointsPanel() {
  const robot = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const joints = useRobotEditor((s) => (s.current ? s.joints[s.current] : undefined))
  const [quantity, setQuantity] = useState<keyof Joints>('q')
  if (!robot || !joints) return null
  const moving = robot.links.filter(({ moves }) => moves)
  return (
    <div className="joints-panel">
      <div className="panel-bar">
        <SegmentedControl
          size="xs"
          data={QUANTITIES}
          value={quantity}
          onChange={(value) => setQuantity(value as keyof Joints)}
          aria-label="Quantity of the sliders"
        />
        <Button size="compact-xs" variant="default" onClick={() => setJoints(atRest(robot))}>
          Home
        </Button>
      </div>
      {moving.map((link, k) => (
        <LinkSlider
          key={link.name}
          link={link}
          quantity={quantity}
          value={joints[quantity][k] ?? 0}
          onValue={(value) =>
            setJoints({ [quantity]: joints[quantity].map((old, i) => (i === k ? value : old)) })
          }
        />
      ))}
    </div>
  )
}

interface LinkSliderProps {
  link: LinkRow
  quantity: keyof Joints
  value: number
  onValue: (value: number) => void
}

function LinkSlider({ link, quantity, value, onValue }: LinkSliderProps) {
  const angles = useRobotEditor((s) => s.angles)
  const [low, high] = range(link, quantity)
  const unit = link.turns ? (angles === 'deg' ? '°' : 'rad') : 'm'
  const per = { q: '', qd: '/s', qdd: '/s²' }[quantity]
  const factor = link.turns && angles === 'deg' ? 180 / Math.PI : 1
  return (
    <JointSlider
      name={link.name}
      label={`${quantity} of ${link.name}`}
      low={low}
      high={high}
      value={value}
      text={cellText(Number((value * factor).toFixed(4)), false, angles)}
      unit={`${unit}${per}`}
      onValue={onValue}
      onNumber={(typed) => onValue(typed / factor)}
    />
  )
}

/**
 * The range of a slider: that of the joint, otherwise ±π rad or ±1 m. The range of speeds is the speed limit;
 * that of accelerations is twice this number.
 */
function range(link: LinkRow, quantity: keyof Joints): [number, number] {
  const { lowest, highest, speed } = link.cells
  const limit = typeof speed === 'number' ? speed : link.turns ? HALF_TURN : DEFAULT_RANGE
  if (quantity === 'qd') return [-limit, limit]
  if (quantity === 'qdd') return [-2 * limit, 2 * limit]
  if (typeof lowest === 'number' && typeof highest === 'number' && lowest < highest) return [lowest, highest]
  return link.turns ? [-HALF_TURN, HALF_TURN] : [-DEFAULT_RANGE, DEFAULT_RANGE]
}
