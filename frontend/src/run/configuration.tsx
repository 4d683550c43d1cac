import { Alert, Button, Checkbox, Group, Modal, NativeSelect, Stack, TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { showDialog, useDialogs } from '../dialogs'
import { valueText } from '../inspector/value_text'
import type { SettingRule, SolverChoice } from '../protocol'
import { ask, change, useStudio } from '../store'

const CHECK_DELAY_MS = 200

/** The run settings of the model: solver, steps, tolerances, stop time. */
export function Configuration() {
  const opened = useDialogs((s) => s.open === 'configuration')
  const close = () => showDialog(null)
  return (
    <Modal
      opened={opened}
      onClose={close}
      closeOnClickOutside={false}
      title={<b>Configuration parameters</b>}
      size="md"
    >
      {opened && <Form onClose={close} />}
    </Modal>
  )
}

/** The text of a setting in the form. */
const settingText = (value: boolean | number | string | null) =>
  typeof value === 'boolean' ? String(value) : numberText(value)

/** Format small numbers as typed: 1e-6. */
const numberText = (value: number | string | null) =>
  typeof value === 'number' && value !== 0 && Math.abs(value) < 1e-3
    ? value.toExponential()
    : valueText(value)

/** Errors of typed settings by name, from the server. */
function useFaults(
  document: string,
  values: Record<string, boolean | string | null>,
): Record<string, string> {
  const [faults, setFaults] = useState<Record<string, string>>({})
  const valuesJson = JSON.stringify(values)
  useEffect(() => {
    let current = true
    const timer = setTimeout(() => {
      void ask({
        kind: 'typed_settings',
        document,
        values: JSON.parse(valuesJson) as typeof values,
      }).then((faults) => {
        if (current && faults) setFaults(faults)
      })
    }, CHECK_DELAY_MS)
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, [valuesJson, document])
  return faults
}

/** All solvers, in groups. */
function solverChoices(solvers: SolverChoice[]) {
  const group = (label: string, adaptive: boolean, stiff: boolean) => ({
    group: label,
    items: solvers
      .filter((solver) => solver.name !== 'auto' && solver.adaptive === adaptive && solver.stiff === stiff)
      .map(({ name, title }) => ({ value: name, label: `${name}: ${title}` })),
  })
  return [
    {
      group: 'Automatic',
      items: solvers
        .filter(({ name }) => name === 'auto')
        .map(({ name, title }) => ({ value: name, label: `${name}: ${title}` })),
    },
    group('Variable step', true, false),
    group('Variable step, for stiff systems', true, true),
    group('Fixed step', false, false),
    group('Fixed step, for stiff systems', false, true),
  ]
}

interface SettingProps {
  rule: SettingRule
  /** The text of the setting; of a switch `true` or `false`. */
  value: string | undefined
  fault: string | undefined
  setValue: (value: string) => void
  solvers: SolverChoice[]
  focused: boolean
}

/** One setting: a list for the solver, a box for a switch, else a field for a number. */
function Setting({ rule, value, fault, setValue, solvers, focused }: SettingProps) {
  const label = (
    <>
      {rule.title}
      {rule.unit && <span className="unit"> {rule.unit}</span>}
    </>
  )
  const common = { label, description: rule.doc, size: 'sm' as const, error: fault || undefined }
  if (rule.name === 'solver')
    return (
      <NativeSelect
        className="wide"
        {...common}
        data={solverChoices(solvers)}
        value={value ?? 'auto'}
        onChange={(event) => setValue(event.currentTarget.value)}
      />
    )
  if (typeof rule.default === 'boolean')
    return (
      <Checkbox
        className="wide"
        {...common}
        checked={value === 'true'}
        onChange={(event) => setValue(String(event.currentTarget.checked))}
      />
    )
  return (
    <TextInput
      {...common}
      data-autofocus={focused || undefined}
      classNames={{ input: 'typed' }}
      value={value ?? ''}
      onChange={(event) => setValue(event.currentTarget.value)}
      placeholder="automatic"
    />
  )
}

function Form({ onClose }: { onClose: () => void }) {
  const document = useStudio((s) => s.document?.state.document ?? '')
  const settings = useStudio((s) => s.document?.settings)
  const welcome = useStudio((s) => s.welcome)
  const run = useStudio((s) => s.run)
  const [initialTexts] = useState(() =>
    Object.fromEntries(Object.entries(settings ?? {}).map(([name, value]) => [name, settingText(value)])),
  )
  const [typed, setTyped] = useState<Record<string, string>>(initialTexts)
  const changed = Object.keys(typed).filter((name) => typed[name] !== initialTexts[name])
  const switches = new Set(
    welcome?.settings.filter((rule) => typeof rule.default === 'boolean').map((r) => r.name),
  )
  const values = Object.fromEntries(
    changed.map((name) => {
      const text = typed[name]?.trim()
      return [name, switches.has(name) ? text === 'true' : text || null]
    }),
  )
  const faults = useFaults(document, values)
  const invalid = changed.length > 0 && Object.keys(faults).length > 0
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        if (!changed.length) onClose()
        else if (!invalid)
          void change({ kind: 'settings', values }).then((done) => done !== undefined && onClose())
      }}
    >
      <Stack gap="sm">
        <div className="settings">
          {welcome?.settings.map((rule, index) => (
            <Setting
              key={rule.name}
              rule={rule}
              fault={faults[rule.name]}
              value={typed[rule.name]}
              setValue={(value) => setTyped((now) => ({ ...now, [rule.name]: value }))}
              solvers={welcome.solvers}
              focused={index === 0}
            />
          ))}
        </div>
        {run?.reason && (
          <Alert color="gray" title={`The last run used ${run.solver}`}>
            {run.reason}
          </Alert>
        )}
        <Group justify="flex-end" gap="xs" className="dialog-actions">
          <Button variant="default" onClick={onClose}>
            Cancel
          </Button>
          <Button type="submit" disabled={invalid}>
            OK
          </Button>
        </Group>
      </Stack>
    </form>
  )
}
