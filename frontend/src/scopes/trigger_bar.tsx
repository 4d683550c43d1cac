import './trigger_bar.css'
import { ActionIcon, Button, NativeSelect, TextInput } from '@mantine/core'
import { IconChevronLeft, IconChevronRight } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import type { Edge, Mode } from '../model/trigger'
import { samples } from '../samples'
import { useStudio } from '../store'
import { displayUnit, formatNumber, useUnits } from './quantity'
import { armTrigger, stepTrigger, useTrigger } from './trigger'

const EDGES = [
  { value: 'rising', label: '↗ rising' },
  { value: 'falling', label: '↘ falling' },
  { value: 'either', label: '↕ either' },
]
const MODES = [
  { value: 'normal', label: 'Normal' },
  { value: 'auto', label: 'Auto' },
  { value: 'single', label: 'Single' },
]

/** The settings of the trigger of all time plots, and the displayed trigger. */
export function TriggerBar() {
  const on = useTrigger((s) => s.on)
  return on ? <Bar /> : null
}

function Bar() {
  const { channel, element, edge, level, mode, span, position, holdOff } = useTrigger()
  useUnits((s) => s.radians)
  const signal = samples.signal(channel)
  const { factor, unit } = displayUnit(signal?.channel.unit ?? '', 0)
  return (
    <div className="trigger-frame">
      <div className="trigger-bar" role="group" aria-label="Trigger">
        <SignalSelect channel={channel} element={element} />
        <Choice
          label="Edge"
          options={EDGES}
          value={edge}
          setValue={(value) => useTrigger.setState({ edge: value as Edge, chosen: null })}
        />
        <NumberField
          label="Level"
          unit={unit}
          value={level * factor}
          setValue={(value) => useTrigger.setState({ level: value / factor, chosen: null })}
        />
        <Choice
          label="Mode"
          options={MODES}
          value={mode}
          setValue={(value) => useTrigger.setState({ mode: value as Mode, chosen: null })}
        />
        <NumberField
          label="Window"
          unit="s"
          value={span}
          isValid={(value) => value > 0}
          setValue={(value) => useTrigger.setState({ span: value })}
        />
        <NumberField
          label="Trigger at"
          unit="%"
          value={100 * position}
          isValid={(value) => value >= 0 && value <= 100}
          setValue={(value) => useTrigger.setState({ position: value / 100 })}
        />
        <NumberField
          label="Hold-off"
          unit="s"
          value={holdOff}
          isValid={(value) => value >= 0}
          setValue={(value) => useTrigger.setState({ holdOff: value, chosen: null })}
        />
        <DisplayedTrigger missing={!signal} />
      </div>
    </div>
  )
}

interface ChoiceProps {
  label: string
  options: { value: string; label: string }[]
  value: string
  setValue: (value: string) => void
}

/** One of a few named options. */
function Choice({ label, options, value, setValue }: ChoiceProps) {
  return (
    <NativeSelect
      size="xs"
      label={label}
      aria-label={label}
      className="choice"
      data={options}
      value={value}
      onChange={(event) => setValue(event.currentTarget.value)}
    />
  )
}

/** All elements of all signals of the run. */
function SignalSelect({ channel, element }: { channel: string; element: number }) {
  useStudio((s) => s.run?.run)
  const options = samples.names.flatMap((name) => {
    const signal = samples.signal(name)!
    return signal.columns.map((_, k) => ({
      value: `${name} ${k}`,
      label:
        samples.title(name) +
        (signal.columns.length > 1 ? ` ${signal.channel.entries[k] ?? String(k + 1)}` : ''),
    }))
  })
  const value = `${channel} ${element}`
  const isKnown = options.some((option) => option.value === value)
  return (
    <NativeSelect
      size="xs"
      label="Trigger on"
      className="signal"
      title={options.find((option) => option.value === value)?.label ?? channel}
      data={isKnown ? options : [{ value, label: channel }, ...options]}
      value={value}
      onChange={(event) => {
        const chosen = event.currentTarget.value
        const separator = chosen.lastIndexOf(' ')
        useTrigger.setState({
          channel: chosen.slice(0, separator),
          element: Number(chosen.slice(separator + 1)),
          chosen: null,
        })
      }}
    />
  )
}

interface NumberProps {
  label: string
  unit: string
  value: number
  isValid?: (value: number) => boolean
  setValue: (value: number) => void
}

/** A number that is used as soon as it is valid; the field is marked while it is not. */
function NumberField({ label, unit, value, isValid = () => true, setValue }: NumberProps) {
  const text = String(Number(value.toPrecision(9)))
  const [typed, setTyped] = useState(text)
  const number = Number(typed.trim().replace('−', '-').replace(',', '.'))
  const valid = typed.trim() !== '' && Number.isFinite(number) && isValid(number)
  useEffect(() => {
    // The value has changed elsewhere, for example with the unit of angles.
    setTyped((present) => (Number(present) === Number(text) ? present : text))
  }, [text])
  return (
    <TextInput
      size="xs"
      w="auto"
      label={label}
      classNames={{ input: 'typed' }}
      rightSection={unit && <span className="unit">{unit}</span>}
      rightSectionWidth={10 + 7 * unit.length}
      rightSectionPointerEvents="none"
      value={typed}
      error={!valid}
      onChange={(event) => {
        const next = event.currentTarget.value
        setTyped(next)
        const parsed = Number(next.trim().replace('−', '-').replace(',', '.'))
        if (next.trim() && Number.isFinite(parsed) && isValid(parsed)) setValue(parsed)
      }}
      onBlur={() => setTyped(text)}
    />
  )
}

/** The number and time of the displayed trigger, and buttons for the others. */
function DisplayedTrigger({ missing }: { missing: boolean }) {
  const { mode, count, index, at } = useTrigger()
  const isRunning = useStudio((s) => s.run?.state === 'running' || s.run?.state === 'paused')
  const single = mode === 'single'
  const text = missing
    ? 'The run has no such signal.'
    : index === null
      ? isRunning
        ? 'Waiting for a trigger'
        : 'No trigger'
      : `${single ? 'Trigger' : `${index + 1} of ${count}`} at ${formatNumber(at!, 6)} s`
  return (
    <div className="shown-trigger">
      {!single && (
        <>
          <ActionIcon
            size="sm"
            variant="subtle"
            color="gray"
            aria-label="Previous trigger"
            disabled={index === null || index === 0}
            onClick={() => stepTrigger(-1)}
          >
            <IconChevronLeft size={15} />
          </ActionIcon>
          <ActionIcon
            size="sm"
            variant="subtle"
            color="gray"
            aria-label="Next trigger"
            disabled={index === null || index === count - 1}
            onClick={() => stepTrigger(1)}
          >
            <IconChevronRight size={15} />
          </ActionIcon>
        </>
      )}
      <span className="numbers" aria-live="polite">
        {text}
      </span>
      {isRunning && (
        <Button size="compact-xs" variant="default" onClick={armTrigger}>
          {single ? 'Arm' : 'Follow'}
        </Button>
      )}
    </div>
  )
}
