import { Button, SegmentedControl } from '@mantine/core'
import { useState } from 'react'
import { isAtLimit } from '../../model/motion'
import { JointSlider } from '../joint_slider'
import { atRest, cellText, setJoints, useRobotEditor, type Joints, type OpenRobot } from './state'

/** Range of an angle without limits, and of a length without limits. */
const DEFAULT_RANGE: Record<string, number> = { rad: Math.PI, m: 1 }

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
      {rangesOf(robot, quantity).map((range, k) => (
        <RangeSlider
          key={range.name}
          range={range}
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

interface Range {
  name: string
  unit: string
  low: number
  high: number
  isLimited: (value: number) => boolean
}

interface RangeSliderProps {
  range: Range
  quantity: keyof Joints
  value: number
  onValue: (value: number) => void
}

function RangeSlider({ range, quantity, value, onValue }: RangeSliderProps) {
  const angles = useRobotEditor((s) => s.angles)
  const { name, low, high, isLimited } = range
  const turns = range.unit === 'rad'
  const unit = turns ? (angles === 'deg' ? '°' : 'rad') : range.unit === 'm' ? 'm' : ''
  const per = { q: '', qd: '/s', qdd: '/s²' }[quantity]
  const factor = turns && angles === 'deg' ? 180 / Math.PI : 1
  return (
    <JointSlider
      name={name}
      label={`${quantity} of ${name}`}
      low={low}
      high={high}
      value={value}
      text={cellText(Number((value * factor).toFixed(4)), false, angles)}
      unit={`${unit}${per}`}
      limited={isLimited(value)}
      onValue={onValue}
      onNumber={(typed) => onValue(typed / factor)}
    />
  )
}

/**
 * The ranges of the sliders. Positions: the limits of the coordinates, otherwise ±π rad or ±1 m. Speeds: the
 * speed limits; accelerations: twice these numbers.
 */
function rangesOf(robot: OpenRobot, quantity: keyof Joints): Range[] {
  if (quantity === 'q')
    return robot.coordinates.map(({ name, unit, low, high }) => {
      const most = DEFAULT_RANGE[unit] ?? 1
      return {
        name,
        unit,
        low: low ?? Math.min(-most, (high ?? most) - most),
        high: high ?? Math.max(most, (low ?? -most) + most),
        isLimited: (value) => isAtLimit(value, low, high),
      }
    })
  return robot.speeds.map(({ name, unit, limit }) => {
    const most = (quantity === 'qd' ? 1 : 2) * (limit ?? DEFAULT_RANGE[unit] ?? 1)
    return { name, unit, low: -most, high: most, isLimited: () => false }
  })
}
