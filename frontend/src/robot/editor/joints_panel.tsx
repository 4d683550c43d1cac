import { Button, SegmentedControl, Slider } from '@mantine/core'
import { useState } from 'react'
import type { LinkRow } from '../../protocol'
import { atRest, cellText, setJoints, useDesk, type Joints } from './desk'

const HALF_TURN = Math.PI
const DEFAULT_RANGE = 1

/** The displayed quantity of the joints: position, speed, acceleration. */
const KINDS = [
  { value: 'q', label: 'q' },
  { value: 'qd', label: 'qd' },
  { value: 'qdd', label: 'qdd' },
]

/** A slider for each joint within its range, and fields for speeds and accelerations. */
export function JointsPanel() {
  const shown = useDesk((s) => (s.current ? s.robots[s.current] : undefined))
  const joints = useDesk((s) => (s.current ? s.joints[s.current] : undefined))
  const [kind, setKind] = useState<keyof Joints>('q')
  if (!shown || !joints) return null
  const moving = shown.links.filter(({ moves }) => moves)
  return (
    <div className="joints-panel">
      <div className="panel-bar">
        <SegmentedControl
          size="xs"
          data={KINDS}
          value={kind}
          onChange={(value) => setKind(value as keyof Joints)}
          aria-label="Quantity of the sliders"
        />
        <Button size="compact-xs" variant="default" onClick={() => setJoints(atRest(shown))}>
          Home
        </Button>
      </div>
      {moving.map((link, k) => (
        <JointSlider
          key={link.name}
          link={link}
          kind={kind}
          value={joints[kind][k] ?? 0}
          onValue={(value) => setJoints({ [kind]: joints[kind].map((old, i) => (i === k ? value : old)) })}
        />
      ))}
    </div>
  )
}

interface JointSliderProps {
  link: LinkRow
  kind: keyof Joints
  value: number
  onValue: (value: number) => void
}

function JointSlider({ link, kind, value, onValue }: JointSliderProps) {
  const angles = useDesk((s) => s.angles)
  const [low, high] = range(link, kind)
  const unit = link.turns ? (angles === 'deg' ? '°' : 'rad') : 'm'
  const per = { q: '', qd: '/s', qdd: '/s²' }[kind]
  const factor = link.turns && angles === 'deg' ? 180 / Math.PI : 1
  return (
    <div className="joint-slider">
      <span className="name" title={link.name}>
        {link.name}
      </span>
      <Slider
        size="sm"
        thumbLabel={`${kind} of ${link.name}`}
        min={low}
        max={high}
        step={(high - low) / 720}
        label={null}
        value={value}
        onChange={onValue}
        marks={low < 0 && high > 0 ? [{ value: 0 }] : []}
      />
      <NumberField
        label={`${kind} of ${link.name} as a number`}
        text={cellText(Number((value * factor).toFixed(4)), false, angles)}
        onNumber={(typed) => onValue(typed / factor)}
      />
      <span className="unit">
        {unit}
        {per}
      </span>
    </div>
  )
}

function NumberField({
  label,
  text,
  onNumber,
}: {
  label: string
  text: string
  onNumber: (value: number) => void
}) {
  const [typed, setTyped] = useState<string | null>(null)
  return (
    <input
      className="cell numbers"
      aria-label={label}
      value={typed ?? text}
      onFocus={(event) => event.currentTarget.select()}
      onChange={(event) => {
        setTyped(event.currentTarget.value)
        const value = Number(event.currentTarget.value)
        if (event.currentTarget.value.trim() && Number.isFinite(value)) onNumber(value)
      }}
      onBlur={() => setTyped(null)}
      onKeyDown={(event) => event.key === 'Enter' && event.currentTarget.blur()}
    />
  )
}

/** The range of a slider: that of the joint, otherwise ±π rad or ±1 m; for speeds the speed limit. */
function range(link: LinkRow, kind: keyof Joints): [number, number] {
  const { lowest, highest, speed } = link.cells
  const limit = typeof speed === 'number' ? speed : link.turns ? HALF_TURN : DEFAULT_RANGE
  if (kind === 'qd') return [-limit, limit]
  if (kind === 'qdd') return [-2 * limit, 2 * limit]
  if (typeof lowest === 'number' && typeof highest === 'number' && lowest < highest) return [lowest, highest]
  return link.turns ? [-HALF_TURN, HALF_TURN] : [-DEFAULT_RANGE, DEFAULT_RANGE]
}
