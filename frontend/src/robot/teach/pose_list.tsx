import { Button, Checkbox, Tooltip } from '@mantine/core'
import {
  IconArrowDown,
  IconArrowUp,
  IconPlayerSkipForward,
  IconRefresh,
  IconTrash,
} from '@tabler/icons-react'
import { useRef, useState } from 'react'
import { edit, useRobotEditor, type OpenRobot } from '../editor/state'
import { goTo, passPose, recordPose, renamePose, updatePose, usePassedPoses } from './state'

/** The recorded poses in the order of the motion. */
export function PoseList() {
  const robot = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const passed = usePassedPoses()
  if (!robot) return null
  const { poses } = robot
  return (
    <section aria-label="Poses">
      <h3>
        Poses
        <Button size="compact-xs" variant="default" onClick={recordPose}>
          Record
        </Button>
      </h3>
      {poses.length === 0 && <p className="hint">Move the arm, and record its poses in their order.</p>}
      <ol className="poses" aria-label="Recorded poses">
        {poses.map((pose, k) => (
          <PoseRow
            key={pose.name}
            pose={pose}
            isPassed={passed.includes(pose.name)}
            place={k}
            count={poses.length}
          />
        ))}
      </ol>
    </section>
  )
}

interface PoseRowProps {
  pose: OpenRobot['poses'][number]
  isPassed: boolean
  place: number
  count: number
}

function PoseRow({ pose: { name, q }, isPassed, place, count }: PoseRowProps) {
  const move = (by: number) => void edit({ kind: 'move_pose', name, by })
  const onKeyDown = (event: React.KeyboardEvent) => {
    if (!event.altKey || (event.key !== 'ArrowUp' && event.key !== 'ArrowDown')) return
    event.preventDefault()
    const by = event.key === 'ArrowUp' ? -1 : 1
    if (place + by >= 0 && place + by < count) move(by)
  }
  return (
    <li onKeyDown={onKeyDown}>
      <Checkbox
        size="xs"
        aria-label={`Motion passes ${name}`}
        title={`Motion passes ${name}`}
        checked={isPassed}
        onChange={(event) => passPose(name, event.currentTarget.checked)}
      />
      <PoseName name={name} />
      <RowButton label={`Go to ${name}`} icon={IconPlayerSkipForward} onClick={() => goTo(q)} />
      <RowButton label={`Update ${name}`} icon={IconRefresh} onClick={() => updatePose(name)} />
      <RowButton label={`Move ${name} up`} icon={IconArrowUp} disabled={!place} onClick={() => move(-1)} />
      <RowButton
        label={`Move ${name} down`}
        icon={IconArrowDown}
        disabled={place === count - 1}
        onClick={() => move(1)}
      />
      <RowButton
        label={`Delete ${name}`}
        icon={IconTrash}
        onClick={() => void edit({ kind: 'remove_pose', name })}
      />
    </li>
  )
}

/** The name of a pose; Enter or leaving the field renames the pose. */
function PoseName({ name }: { name: string }) {
  const [typed, setTyped] = useState<string | null>(null)
  const [refusal, setRefusal] = useState('')
  const isDiscarded = useRef(false)
  const accept = async () => {
    const to = typed?.trim()
    if (isDiscarded.current || to === undefined || to === name) {
      isDiscarded.current = false
      setTyped(null)
      return
    }
    const fault = await renamePose(name, to)
    setRefusal(fault?.what ?? '')
    if (!fault) setTyped(null)
  }
  return (
    <Tooltip label={refusal} opened={refusal !== ''} color="red" multiline w={240}>
      <input
        className={refusal ? 'cell wide wrong' : 'cell wide'}
        aria-label={`Name of ${name}`}
        aria-invalid={refusal !== ''}
        value={typed ?? name}
        onChange={(event) => {
          setTyped(event.currentTarget.value)
          setRefusal('')
        }}
        onBlur={() => void accept()}
        onKeyDown={(event) => {
          if (event.key === 'Enter') event.currentTarget.blur()
          if (event.key !== 'Escape') return
          isDiscarded.current = true
          setRefusal('')
          event.currentTarget.blur()
        }}
      />
    </Tooltip>
  )
}

interface RowButtonProps {
  label: string
  icon: React.ComponentType<{ size: number }>
  disabled?: boolean
  onClick: () => void
}

function RowButton({ label, icon: Icon, disabled = false, onClick }: RowButtonProps) {
  return (
    <button
      type="button"
      className="dots"
      aria-label={label}
      title={label}
      disabled={disabled}
      onClick={onClick}
    >
      <Icon size={14} />
    </button>
  )
}
