import { Slider } from '@mantine/core'
import { IconAlertTriangle } from '@tabler/icons-react'
import { useState } from 'react'

interface JointSliderProps {
  name: string
  /** The accessible name of the slider. */
  label: string
  low: number
  high: number
  value: number
  /** The value as text, in the unit of the field. */
  text: string
  unit: string
  disabled?: boolean
  /** Whether the value is at a limit, which is marked. */
  limited?: boolean
  /** Called with a value of the slider. */
  onValue: (value: number) => void
  /** Called with a number that was typed, in the unit of the field. */
  onNumber: (value: number) => void
}

/** A slider for one coordinate, and a field with its number. */
export function JointSlider(props: JointSliderProps) {
  const {
    name,
    label,
    low,
    high,
    value,
    text,
    unit,
    disabled = false,
    limited = false,
    onValue,
    onNumber,
  } = props
  return (
    <div className={limited ? 'joint-slider limited' : 'joint-slider'}>
      <span className="name" title={limited ? `${name} is at its limit` : name}>
        {name}
        {limited && (
          <IconAlertTriangle size={12} role="img" aria-label={`${name} is at its limit`} className="warn" />
        )}
      </span>
      <Slider
        size="sm"
        thumbLabel={label}
        min={low}
        max={high}
        step={(high - low) / 720}
        label={null}
        value={value}
        disabled={disabled}
        onChange={onValue}
        marks={low < 0 && high > 0 ? [{ value: 0 }] : []}
      />
      <NumberField label={`${label} as a number`} text={text} disabled={disabled} onNumber={onNumber} />
      <span className="unit">{unit}</span>
    </div>
  )
}

interface NumberFieldProps {
  label: string
  text: string
  disabled: boolean
  onNumber: (value: number) => void
}

function NumberField({ label, text, disabled, onNumber }: NumberFieldProps) {
  const [typed, setTyped] = useState<string | null>(null)
  return (
    <input
      className="cell numbers"
      aria-label={label}
      value={typed ?? text}
      disabled={disabled}
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
