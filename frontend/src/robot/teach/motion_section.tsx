import { ActionIcon, Button, SegmentedControl, Slider, TextInput } from '@mantine/core'
import { IconAlertTriangle, IconPlayerPauseFilled, IconPlayerPlayFilled } from '@tabler/icons-react'
import { shareOf } from '../../model/motion'
import { useStudio } from '../../store'
import { shortNumber, useRobotEditor } from '../editor/state'
import { insertMotion } from './insert_motion'
import { SaveMotionDialog } from './save_motion_dialog'
import {
  chooseMotion,
  pausePlayback,
  playMotion,
  runMotion,
  showTime,
  usePassedPoses,
  useTeaching,
  type Course,
  type ShownMotion,
} from './state'

const COURSES = [
  { value: 'joint', label: 'Joint' },
  { value: 'line', label: 'Line' },
  { value: 'spline', label: 'Spline' },
]

/** The motion through the selected poses: its kind and duration, playback, peaks, file and block. */
export function MotionSection() {
  const count = usePassedPoses().length
  const { course, duration, fault, motion } = useTeaching()
  return (
    <section aria-label="Motion">
      <h3>Motion</h3>
      <div className="row">
        <SegmentedControl
          size="xs"
          aria-label="Kind of motion"
          data={COURSES}
          value={course}
          onChange={(value) => chooseMotion({ course: value as Course })}
        />
        <TextInput
          size="xs"
          w={118}
          aria-label="Duration in s"
          placeholder="least time"
          rightSection={<span className="unit">s</span>}
          value={duration}
          onChange={(event) => chooseMotion({ duration: event.currentTarget.value })}
          onKeyDown={(event) => event.key === 'Enter' && void runMotion()}
        />
        <Button size="compact-xs" disabled={count < 2} onClick={() => void runMotion()}>
          Run
        </Button>
      </div>
      {count < 2 && (
        <p className="hint">A motion needs two poses: record them, or select them in the list.</p>
      )}
      {fault && (
        <p className="warnings" role="alert">
          <IconAlertTriangle size={14} aria-hidden /> {fault}
        </p>
      )}
      {motion && <Planned motion={motion} />}
      <SaveMotionDialog />
    </section>
  )
}

function Planned({ motion }: { motion: ShownMotion }) {
  const diagram = useStudio((s) => s.document)
  return (
    <>
      <Playback motion={motion} />
      <Peaks motion={motion} />
      {motion.exceeded.length > 0 && (
        <ul className="warnings" aria-label="Exceeded limits">
          {motion.exceeded.map((text) => (
            <li key={text}>
              <IconAlertTriangle size={14} aria-hidden /> {text}
            </li>
          ))}
        </ul>
      )}
      <div className="row">
        <Button
          size="compact-xs"
          variant="default"
          onClick={() => useTeaching.setState({ saving: 'motion.csv', refusal: '' })}
        >
          Save the trajectory …
        </Button>
        <Button
          size="compact-xs"
          variant="default"
          disabled={!diagram}
          title={diagram ? `A Trajectory block in ${diagram.name}` : 'No diagram is open'}
          onClick={() => void insertMotion()}
        >
          Insert into the diagram
        </Button>
      </div>
    </>
  )
}

function Playback({ motion }: { motion: ShownMotion }) {
  const { time, playing } = useTeaching()
  const end = motion.time.at(-1)!
  const label = playing ? 'Pause the motion' : 'Play the motion'
  return (
    <div className="playback">
      <ActionIcon
        variant="subtle"
        color="gray"
        aria-label={label}
        title={label}
        onClick={playing ? pausePlayback : playMotion}
      >
        {playing ? <IconPlayerPauseFilled size={15} /> : <IconPlayerPlayFilled size={15} />}
      </ActionIcon>
      <Slider
        size="sm"
        thumbLabel="Time of the motion"
        min={0}
        max={end}
        step={end / 1000}
        label={null}
        value={Math.min(time, end)}
        marks={motion.via.map((value) => ({ value }))}
        onChange={(value) => {
          pausePlayback()
          showTime(value)
        }}
      />
      <output className="numbers" aria-label="Duration of the motion">
        {time.toFixed(2)} / {end.toFixed(2)} s
      </output>
    </div>
  )
}

/** The largest speed and torque of each joint, and their shares of the limits where there are limits. */
function Peaks({ motion }: { motion: ShownMotion }) {
  const angles = useRobotEditor((s) => s.angles)
  const hasSpeedLimits = motion.peaks.some(({ speed_limit }) => speed_limit !== null)
  const hasTorqueLimits = motion.peaks.some(({ torque_limit }) => torque_limit !== null)
  return (
    <table className="peaks numbers" aria-label="Peaks of the motion">
      <thead>
        <tr>
          <th scope="col">joint</th>
          <th scope="col">speed</th>
          {hasSpeedLimits && <th scope="col">of limit</th>}
          <th scope="col">torque</th>
          {hasTorqueLimits && <th scope="col">of limit</th>}
        </tr>
      </thead>
      <tbody>
        {motion.peaks.map(({ name, unit, speed, speed_limit, torque, torque_limit }) => {
          const degrees = unit === 'rad' && angles === 'deg'
          const shownSpeed = shortNumber(degrees ? (speed * 180) / Math.PI : speed, 2)
          return (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{`${shownSpeed} ${degrees ? '°' : unit}/s`}</td>
              {hasSpeedLimits && <Share share={shareOf(speed, speed_limit)} />}
              <td>{`${shortNumber(torque, 2)} ${unit === 'rad' ? 'N m' : 'N'}`}</td>
              {hasTorqueLimits && <Share share={shareOf(torque, torque_limit)} />}
            </tr>
          )
        })}
      </tbody>
      <tfoot>
        <tr>
          <td colSpan={5}>tool speed at most {shortNumber(motion.tool_speed, 3)} m/s</td>
        </tr>
      </tfoot>
    </table>
  )
}

/** Excess over a limit, in percent, up to which it is attributed to rounding and interpolation. */
const TOLERANCE = 0.1

/** A share of a limit in percent, with a bar; empty without a limit. */
function Share({ share }: { share: number | undefined }) {
  if (share === undefined) return <td />
  return (
    <td className={share > 100 + TOLERANCE ? 'over' : 'share'}>
      {Math.round(share)} %
      <meter aria-hidden min={0} max={100} value={Math.min(share, 100)} />
    </td>
  )
}
