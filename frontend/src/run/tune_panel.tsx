import { ActionIcon, Button, Group, Slider, Text, TextInput, Tooltip } from '@mantine/core'
import { IconArrowBackUp, IconPin, IconPinFilled } from '@tabler/icons-react'
import { useEffect, useMemo, useState } from 'react'
import { valueText } from '../inspector/value_text'
import type { Tunable } from '../protocol'
import { useStudio } from '../store'
import { ParameterSetMenu } from './parameter_set_menu'
import { usePinnedParameters } from './pinned_parameters'
import { useRuns } from './runs'
import { dropTrialValues, keepTrialValues, tryValue, useKnownParameters } from './trial_values'

const NUMERIC = ['number', 'array']
const SLIDER_STEPS = 400

/**
 * The tunable parameters of the visible sheet, with the values of the model; for subsystems, as listed by
 * the last run.
 */
function useTunables(): Map<string, Tunable> {
  const blocks = useStudio((s) => s.document?.blocks)
  const library = useStudio((s) => s.library)
  const pathPrefix = useStudio((s) => s.document?.inside.map((name) => `${name}/`).join('') ?? '')
  const ofRun = useStudio((s) => s.run?.tunables)
  const ofSets = useKnownParameters((s) => s.parameters)
  return useMemo(() => {
    const tunables = new Map((ofRun ?? []).map((tunable) => [tunable.path, tunable]))
    for (const [path, parameter] of ofSets)
      tunables.set(path, { low: null, high: null, ...tunables.get(path), ...parameter })
    for (const block of Object.values(blocks ?? {})) {
      if (block.comment) continue
      for (const rule of library.get(block.type)?.parameters ?? []) {
        if (!rule.tunable || !NUMERIC.includes(rule.kind)) continue
        const path = `${pathPrefix}${block.name}.${rule.name}`
        const ofLastRun = tunables.get(path)
        tunables.set(path, {
          path,
          value: block.parameters[rule.name],
          unit: rule.unit,
          doc: rule.doc,
          low: ofLastRun?.low ?? null,
          high: ofLastRun?.high ?? null,
        })
      }
    }
    return tunables
  }, [blocks, library, pathPrefix, ofRun, ofSets])
}

/** Tunable parameters of the selected and pinned blocks, which can be changed during a run. */
export function TunePanel() {
  const tunables = useTunables()
  const selection = useStudio((s) => s.selection)
  const pathPrefix = useStudio((s) => s.document?.inside.map((name) => `${name}/`).join('') ?? '')
  const pinned = usePinnedParameters((s) => s.pinned)
  const trialValues = useRuns((s) => s.trialValues)
  const selectedPaths = [...selection].map((name) => pathPrefix + name)
  const listed = [...tunables.values()].filter(
    ({ path }) =>
      pinned.has(path) ||
      path in trialValues ||
      selectedPaths.some((name) => path.startsWith(`${name}.`) || path.startsWith(`${name}/`)),
  )
  const count = Object.keys(trialValues).length
  return (
    <div className="tune">
      <ParameterSetMenu />
      <div className="tuned-rows">
        {listed.map((tunable) => (
          <TuneRow key={tunable.path} tunable={tunable} />
        ))}
        {!listed.length && (
          <p className="empty">
            Select a block to see the parameters that can be changed while the model runs. Pinned parameters
            stay in this list.
          </p>
        )}
      </div>
      {count > 0 && (
        <Group gap="xs" className="tried">
          <Text size="xs" c="dimmed" flex={1}>
            {count === 1 ? 'One tried value is' : `${count} tried values are`} not saved in the model.
          </Text>
          <Button
            size="compact-xs"
            variant="default"
            onClick={() => void dropTrialValues(Object.keys(trialValues))}
          >
            Drop
          </Button>
          <Button size="compact-xs" onClick={() => void keepTrialValues()}>
            Keep in the model
          </Button>
        </Group>
      )}
    </div>
  )
}

function TuneRow({ tunable }: { tunable: Tunable }) {
  const { path, unit, doc } = tunable
  const trialValues = useRuns((s) => s.trialValues)
  const changed = path in trialValues
  const value = changed ? trialValues[path] : tunable.value
  const text = valueText(value)
  const [typed, setTyped] = useState(text)
  useEffect(() => setTyped(text), [text])
  const nameAt = path.lastIndexOf('.') + 1
  const commit = () => {
    const number = Number(typed)
    if (typed.trim() && typed !== text) tryValue(path, Number.isFinite(number) ? number : typed)
  }
  return (
    <div className={changed ? 'tune-row changed' : 'tune-row'}>
      <div className="tune-head" title={doc}>
        <span className="path">
          {path.slice(0, Math.max(nameAt - 1, 0))}
          <b>
            {nameAt > 0 && '.'}
            {path.slice(nameAt)}
          </b>
          {unit && <span className="unit"> {unit}</span>}
        </span>
        {changed && (
          <Tooltip label={`Back to ${valueText(tunable.value)}`}>
            <ActionIcon
              size="xs"
              variant="subtle"
              color="gray"
              aria-label={`Discard the value of ${path}`}
              onClick={() => void dropTrialValues([path])}
            >
              <IconArrowBackUp size={13} />
            </ActionIcon>
          </Tooltip>
        )}
        <Pin path={path} />
        <TextInput
          size="xs"
          w={typeof value === 'number' ? 92 : 160}
          aria-label={path}
          classNames={{ input: 'typed' }}
          value={typed}
          onChange={(event) => setTyped(event.currentTarget.value)}
          onBlur={commit}
          onKeyDown={(event) => event.key === 'Enter' && commit()}
        />
      </div>
      {typeof value === 'number' && <ValueSlider tunable={tunable} value={value} />}
    </div>
  )
}

function Pin({ path }: { path: string }) {
  const pinned = usePinnedParameters((s) => s.pinned.has(path))
  return (
    <ActionIcon
      size="xs"
      variant="subtle"
      color="gray"
      aria-label={pinned ? `Unpin ${path}` : `Pin ${path}`}
      aria-pressed={pinned}
      onClick={() =>
        usePinnedParameters.setState((s) => {
          const next = new Set(s.pinned)
          if (!next.delete(path)) next.add(path)
          return { pinned: next }
        })
      }
    >
      {pinned ? <IconPinFilled size={13} /> : <IconPin size={13} />}
    </ActionIcon>
  )
}

/** A slider with editable bounds. */
function ValueSlider({ tunable, value }: { tunable: Tunable; value: number }) {
  const { path, low, high } = tunable
  const userRange = usePinnedParameters((s) => s.ranges[path])
  const modelValue = typeof tunable.value === 'number' ? tunable.value : 0
  const [from, to] = userRange ?? [
    low ?? Math.min(2 * modelValue, modelValue === 0 ? -1 : 0),
    high ?? Math.max(2 * modelValue, modelValue === 0 ? 1 : 0),
  ]
  const bound = (index: 0 | 1) => (
    <input
      key={`${from} ${to}`}
      className="bound numbers"
      aria-label={`${index ? 'Maximum' : 'Minimum'} value of the slider of ${path}`}
      defaultValue={index ? to : from}
      onBlur={(event) => {
        const number = Number(event.currentTarget.value)
        const range: [number, number] = index ? [from, number] : [number, to]
        if (Number.isFinite(number) && range[0] < range[1])
          usePinnedParameters.setState((s) => ({ ranges: { ...s.ranges, [path]: range } }))
        else event.currentTarget.value = String(index ? to : from)
      }}
      onKeyDown={(event) => event.key === 'Enter' && event.currentTarget.blur()}
    />
  )
  return (
    <div className="tune-slide">
      {bound(0)}
      <Slider
        size="xs"
        flex={1}
        label={null}
        thumbLabel={`Slider of ${path}`}
        min={from}
        max={to}
        step={(to - from) / SLIDER_STEPS}
        value={Math.min(Math.max(value, from), to)}
        onChange={(sliderValue) => tryValue(path, Number(sliderValue.toPrecision(6)))}
      />
      {bound(1)}
    </div>
  )
}
