import { Button, NativeSelect, SegmentedControl } from '@mantine/core'
import { IconAlertTriangle } from '@tabler/icons-react'
import { useState } from 'react'
import { isAtLimit } from '../../model/motion'
import { coordinatesOf, poseOf, type PoseMatrix } from '../../model/tool_pose'
import { useRobotEditor } from '../editor/state'
import { dragTo, jog, toggleWorkspace, useTeaching } from './state'

const DEGREE = Math.PI / 180
const NAMES = ['x', 'y', 'z', 'roll', 'pitch', 'yaw']
const DIRECTIONS = ['x', 'y', 'z', 'rotation about x', 'rotation about y', 'rotation about z']
const HANDLES = [
  { value: 'off', label: 'No handle' },
  { value: 'translate', label: 'Move' },
  { value: 'rotate', label: 'Turn' },
]
const STEPS = [0.001, 0.005, 0.01, 0.05, 0.1].map((step) => ({
  value: String(step),
  label: `${1000 * step} mm`,
}))
const TURNS = [0.5, 1, 5, 15, 45].map((turn) => ({ value: String(turn), label: `${turn}°` }))

/** The pose of the tool: typed, moved in steps, or dragged by the handle in the view of the arm. */
export function ToolSection() {
  const tool = useRobotEditor((s) => s.readings?.pose)
  const reading = useRobotEditor((s) => s.reading)
  const { handle, axes, step, turn, moving } = useTeaching()
  if (!tool) return <p className="empty">Compiling the arm …</p>
  const T = tool.flat()
  return (
    <section aria-label="Tool" aria-busy={moving || reading}>
      <h3>Tool</h3>
      <div className="row">
        <SegmentedControl
          size="xs"
          aria-label="Handle of the tool"
          data={HANDLES}
          value={handle}
          onChange={(value) => useTeaching.setState({ handle: value as typeof handle })}
        />
        <SegmentedControl
          size="xs"
          aria-label="Axes"
          data={[
            { value: 'world', label: 'World' },
            { value: 'tool', label: 'Tool' },
          ]}
          value={axes}
          onChange={(value) => useTeaching.setState({ axes: value })}
        />
        <WorkspaceButton />
      </div>
      <ToolFields T={T} />
      <div className="jog" role="group" aria-label="Steps of the tool">
        {DIRECTIONS.map((name, direction) => (
          <span key={name}>
            <JogButton T={T} name={name} direction={direction} sign={-1} />
            <i>{direction < 3 ? name : `r${name.at(-1)}`}</i>
            <JogButton T={T} name={name} direction={direction} sign={1} />
          </span>
        ))}
        <NativeSelect
          size="xs"
          aria-label="Step"
          data={STEPS}
          value={String(step)}
          onChange={(event) => useTeaching.setState({ step: Number(event.currentTarget.value) })}
        />
        <NativeSelect
          size="xs"
          aria-label="Angle of a step"
          data={TURNS}
          value={String(Math.round((10 * turn) / DEGREE) / 10)}
          onChange={(event) => useTeaching.setState({ turn: Number(event.currentTarget.value) * DEGREE })}
        />
      </div>
      <Stopped />
    </section>
  )
}

function WorkspaceButton() {
  const isShown = useTeaching((s) => s.workspace !== null)
  return (
    <Button
      size="compact-xs"
      variant={isShown ? 'light' : 'default'}
      aria-pressed={isShown}
      onClick={() => void toggleWorkspace()}
    >
      Workspace
    </Button>
  )
}

interface JogButtonProps {
  T: PoseMatrix
  name: string
  direction: number
  sign: number
}

function JogButton({ T, name, direction, sign }: JogButtonProps) {
  return (
    <button
      type="button"
      aria-label={`${sign < 0 ? 'Decrease' : 'Increase'} ${name}`}
      onClick={() => jog(T, direction, sign)}
    >
      {sign < 0 ? '−' : '+'}
    </button>
  )
}

/** The position and the angles of the tool in the world; Enter moves the tool to the typed pose. */
function ToolFields({ T }: { T: PoseMatrix }) {
  const angles = useRobotEditor((s) => s.angles)
  const [typed, setTyped] = useState<Record<number, string>>({})
  const values = coordinatesOf(T)
  const factor = (k: number) => (k < 3 ? 1 : angles === 'deg' ? DEGREE : 1)
  const text = (k: number) => (Math.round((1e4 * values[k]!) / factor(k)) / 1e4 + 0).toFixed(k < 3 ? 4 : 3)
  const isWrong = (k: number) => typed[k] !== undefined && !Number.isFinite(parsed(typed[k]))
  const accept = () => {
    if (NAMES.some((_, k) => isWrong(k))) return
    const goal = values.map((value, k) => (typed[k] === undefined ? value : parsed(typed[k]) * factor(k)))
    setTyped({})
    dragTo(poseOf(goal))
  }
  return (
    <div className="tool-fields">
      {NAMES.map((name, k) => (
        <label key={name}>
          <span>
            {name} <span className="unit">{k < 3 ? 'm' : angles === 'deg' ? '°' : 'rad'}</span>
          </span>
          <input
            className={isWrong(k) ? 'cell numbers wrong' : 'cell numbers'}
            aria-label={`${name} of the tool`}
            aria-invalid={isWrong(k)}
            value={typed[k] ?? text(k)}
            onFocus={(event) => event.currentTarget.select()}
            onChange={(event) => setTyped({ ...typed, [k]: event.currentTarget.value })}
            onKeyDown={(event) => {
              if (event.key === 'Enter') accept()
              else if (event.key === 'Escape') setTyped({})
            }}
          />
        </label>
      ))}
    </div>
  )
}

const parsed = (text: string) => (text.trim() ? Number(text.trim().replace(',', '.').replace('−', '-')) : NaN)

/** Why the tool has stopped, which joints are at limits, and which directions the joints cannot follow. */
function Stopped() {
  const { why, missing } = useTeaching()
  const limited = useRobotEditor((s) => {
    const robot = s.current ? s.robots[s.current] : undefined
    const q = s.current ? s.joints[s.current]?.q : undefined
    return (robot?.coordinates ?? [])
      .filter(({ low, high }, k) => q && isAtLimit(q[k] ?? 0, low, high))
      .map(({ name }) => name)
      .join(', ')
  })
  const texts = [
    why && `The tool stops at the nearest pose: ${why}.`,
    limited && `At the limit: ${limited}.`,
  ].filter(Boolean)
  return (
    <div aria-live="polite">
      {texts.length > 0 && (
        <ul className="warnings" aria-label="Limits of the tool">
          {texts.map((text) => (
            <li key={text}>
              <IconAlertTriangle size={14} aria-hidden /> {text}
            </li>
          ))}
        </ul>
      )}
      {missing.length > 0 && <p className="hint">The joints of this arm cannot {missing.join(', ')}.</p>}
    </div>
  )
}
