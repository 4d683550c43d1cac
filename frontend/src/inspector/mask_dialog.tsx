import { ActionIcon, Alert, Button, Group, Modal, NativeSelect, Stack, Text, TextInput } from '@mantine/core'
import { IconArrowDown, IconArrowUp, IconPlus, IconTrash } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import { Refusal } from '../connection'
import { showDialog, useDialogs } from '../dialogs'
import { newKey } from '../keys'
import type { MaskParameter } from '../protocol'
import { ask, attempt, freeName, useStudio } from '../store'
import { valueText } from './value_text'

const TYPES = [
  { value: 'number', label: 'number' },
  { value: 'array', label: 'array' },
  { value: 'integer', label: 'integer' },
  { value: 'boolean', label: 'true or false' },
  { value: 'choice', label: 'choice' },
  { value: 'string', label: 'text' },
  { value: 'robot', label: 'robot' },
]
const COLUMNS = ['Name', 'Kind', 'Default', 'Unit', 'Range or choices', 'Description']

/**
 * A parameter as typed in its row; `range` is for example `0 … 10` or `> 0`; for a choice, the allowed
 * values separated by commas.
 */
interface Row {
  key: string
  was: string
  name: string
  kind: NonNullable<MaskParameter['kind']>
  value: string
  unit: string
  range: string
  doc: string
}

const close = () => showDialog(null)

/**
 * The mask of a subsystem or of the model: parameters are declared, renamed and ordered. Formulas of the
 * blocks inside can use them.
 */
export function MaskDialog() {
  const opened = useDialogs((s) => s.open === 'mask')
  const block = useDialogs((s) => s.maskOwner)
  return (
    <Modal
      opened={opened}
      onClose={close}
      closeOnClickOutside={false}
      closeButtonProps={{ 'aria-label': 'Close' }}
      title={<b>{block ? `Mask of ${block}` : 'Parameters of the model'}</b>}
      size={940}
    >
      {opened && <Mask onClose={close} />}
    </Modal>
  )
}

function Mask({ onClose }: { onClose: () => void }) {
  const [{ inside, block }] = useState(maskLocation)
  const [rows, setRows] = useState<Row[] | null>(null)
  const [face, setFace] = useState('')
  const [fault, setFault] = useState<Refusal | null>(null)
  useEffect(() => {
    const { document } = useStudio.getState()
    if (!document) return
    void ask({ kind: 'ask_mask', document: document.state.document, inside, block }).then((mask) => {
      if (!mask) return onClose()
      setRows(mask.parameters.map(rowOf))
      setFace(mask.name ?? '')
    })
  }, [inside, block, onClose])
  if (!rows) return null
  const valid = rows.every(hasValidRange)
  const apply = async () => {
    try {
      await attempt({ kind: 'mask', block, name: face.trim(), parameters: rows.map(declared) }, inside)
      setFault(null)
      setRows(rows.map((row) => ({ ...row, was: row.name.trim() })))
      return true
    } catch (error) {
      if (!(error instanceof Refusal)) throw error
      setFault(error)
      return false
    }
  }
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        void apply().then((done) => done && onClose())
      }}
    >
      <Stack gap="sm">
        <Text size="sm">
          Values of the blocks inside may be formulas over these names, such as{' '}
          <code>2*{rows[0]?.name ?? 'k'}</code>. {block && 'They are the parameters of the subsystem block.'}
        </Text>
        {block && (
          <TextInput
            label="Text on the block"
            size="sm"
            w={280}
            value={face}
            onChange={(event) => setFace(event.currentTarget.value)}
          />
        )}
        <Rows rows={rows} setRows={setRows} />
        {rows.length === 0 && (
          <Text size="sm" c="dimmed">
            The mask has no parameters yet.
          </Text>
        )}
        <AddRow rows={rows} setRows={setRows} />
        {fault && <FaultAlert fault={fault} />}
        <Group justify="flex-end" gap="xs">
          <Button variant="default" onClick={onClose}>
            Cancel
          </Button>
          <Button variant="default" disabled={!valid} onClick={() => void apply()}>
            Apply
          </Button>
          <Button type="submit" disabled={!valid}>
            OK
          </Button>
        </Group>
      </Stack>
    </form>
  )
}

function FaultAlert({ fault }: { fault: Refusal }) {
  return (
    <Alert color="red" title={fault.what} role="alert">
      {[
        fault.where && `${fault.where}.`,
        fault.allowed && `Allowed: ${fault.allowed}.`,
        fault.fix && `To do: ${fault.fix}.`,
      ]
        .filter(Boolean)
        .join(' ')}
    </Alert>
  )
}

function Rows({ rows, setRows }: { rows: Row[]; setRows: (rows: Row[]) => void }) {
  const updateRow = (key: string, change: Partial<Row>) =>
    setRows(rows.map((row) => (row.key === key ? { ...row, ...change } : row)))
  const swap = (k: number, step: number) => {
    const next = [...rows]
    ;[next[k], next[k + step]] = [next[k + step]!, next[k]!]
    setRows(next)
  }
  if (!rows.length) return null
  return (
    <div className="mask-rows" role="table" aria-label="Parameters">
      <div role="row" className="head">
        {COLUMNS.map((title) => (
          <span key={title} role="columnheader">
            {title}
          </span>
        ))}
        <span role="columnheader" aria-label="Order" />
      </div>
      {rows.map((row, k) => (
        <RowFields
          key={row.key}
          row={row}
          update={(change) => updateRow(row.key, change)}
          first={k === 0}
          last={k === rows.length - 1}
          swap={(step) => swap(k, step)}
          remove={() => setRows(rows.filter((one) => one !== row))}
        />
      ))}
    </div>
  )
}

function AddRow({ rows, setRows }: { rows: Row[]; setRows: (rows: Row[]) => void }) {
  const add = () => {
    const name = freeName(
      'k',
      rows.map((row) => row.name),
    ).replace(' ', '')
    setRows([
      ...rows,
      { key: newKey(), was: '', name, kind: 'number', value: '1', unit: '', range: '', doc: '' },
    ])
  }
  return (
    <Button
      variant="default"
      size="xs"
      leftSection={<IconPlus size={14} />}
      style={{ alignSelf: 'start' }}
      onClick={add}
      // The rows are loaded after the dialog has taken the focus.
      autoFocus={rows.length === 0}
    >
      Add a parameter
    </Button>
  )
}

interface RowProps {
  row: Row
  update: (change: Partial<Row>) => void
  first: boolean
  last: boolean
  swap: (step: -1 | 1) => void
  remove: () => void
}

function RowFields({ row, update, first, last, swap, remove }: RowProps) {
  const robots = useStudio((s) => s.welcome?.robots) ?? []
  const field = (
    label: string,
    key: 'name' | 'value' | 'unit' | 'range' | 'doc',
    mono = false,
    placeholder = '',
  ) => (
    <span role="cell">
      <TextInput
        size="xs"
        aria-label={`${label} of ${row.name}`}
        value={row[key]}
        placeholder={placeholder}
        error={key === 'range' && !hasValidRange(row)}
        onChange={(event) => update({ [key]: event.currentTarget.value })}
        {...(mono ? { classNames: { input: 'typed' } } : {})}
        {...(key === 'name' && first ? { autoFocus: true } : {})}
      />
    </span>
  )
  const choose = (
    label: string,
    data: string[] | typeof TYPES,
    value: string,
    update: (value: string) => void,
  ) => (
    <span role="cell">
      <NativeSelect
        size="xs"
        aria-label={`${label} of ${row.name}`}
        data={data}
        value={value}
        onChange={(event) => update(event.currentTarget.value)}
      />
    </span>
  )
  const value = (value: string) => update({ value })
  const options = row.range
    .split(',')
    .map((word) => word.trim())
    .filter(Boolean)
  const hasRange = typeHasRange(row.kind)
  return (
    <div role="row">
      {field('Name', 'name', true)}
      {choose('Kind', TYPES, row.kind, (kind) =>
        update({ kind: kind as Row['kind'], ...initialValues(kind, robots) }),
      )}
      {row.kind === 'boolean'
        ? choose('Default', ['true', 'false'], row.value, value)
        : row.kind === 'robot'
          ? choose('Default', robots.includes(row.value) ? robots : [row.value, ...robots], row.value, value)
          : row.kind === 'choice' && options.length > 0
            ? choose(
                'Default',
                options.includes(row.value) ? options : [row.value, ...options],
                row.value,
                value,
              )
            : field('Default', 'value', true)}
      {hasRange ? field('Unit', 'unit') : <span role="cell" />}
      {hasRange ? (
        field('Range', 'range', true, '0 … 10, > 0')
      ) : row.kind === 'choice' ? (
        field('Choices', 'range', false, 'one, another')
      ) : (
        <span role="cell" />
      )}
      {field('Description', 'doc')}
      <Order name={row.name} first={first} last={last} swap={swap} remove={remove} />
    </div>
  )
}

type OrderProps = Pick<RowProps, 'first' | 'last' | 'swap' | 'remove'> & { name: string }

function Order({ name, first, last, swap, remove }: OrderProps) {
  return (
    <span role="cell" className="order">
      <ActionIcon
        size="sm"
        variant="subtle"
        color="gray"
        aria-label={`Move ${name} up`}
        disabled={first}
        onClick={() => swap(-1)}
      >
        <IconArrowUp size={14} />
      </ActionIcon>
      <ActionIcon
        size="sm"
        variant="subtle"
        color="gray"
        aria-label={`Move ${name} down`}
        disabled={last}
        onClick={() => swap(1)}
      >
        <IconArrowDown size={14} />
      </ActionIcon>
      <ActionIcon size="sm" variant="subtle" color="gray" aria-label={`Remove ${name}`} onClick={remove}>
        <IconTrash size={14} />
      </ActionIcon>
    </span>
  )
}

/**
 * The owner of a mask: a block of the visible sheet, or the visible sheet itself, which is a block of the
 * sheet around it.
 */
function maskLocation(): { inside: string[]; block: string } {
  const { maskOwner, ownsVisibleSheet } = useDialogs.getState()
  const inside = useStudio.getState().document?.inside ?? []
  return { inside: maskOwner && ownsVisibleSheet ? inside.slice(0, -1) : inside, block: maskOwner }
}

/** The initial values of a row after a change of its type. */
function initialValues(kind: string, robots: string[]): Partial<Row> {
  if (kind === 'boolean') return { value: 'true', range: '' }
  if (kind === 'robot') return { value: robots[0] ?? '', range: '' }
  if (kind === 'choice') return { value: 'one', range: 'one, another' }
  return { value: kind === 'string' ? '' : kind === 'array' ? '[1 2]' : '1', range: '' }
}

function rowOf({
  name,
  was = '',
  kind = 'number',
  default: value,
  unit = '',
  doc = '',
  minimum,
  above,
  maximum,
  choices = [],
}: MaskParameter): Row {
  return {
    key: newKey(),
    was,
    name,
    kind,
    value: valueText(value),
    unit,
    doc,
    range:
      kind === 'choice' ? choices.join(', ') : rangeText(minimum ?? null, above ?? null, maximum ?? null),
  }
}

function rangeText(minimum: number | null, above: number | null, maximum: number | null): string {
  const low =
    above !== null
      ? `> ${above}`
      : minimum !== null
        ? maximum === null
          ? `>= ${minimum}`
          : String(minimum)
        : ''
  if (maximum === null) return low
  return low ? `${low} … ${maximum}` : `<= ${maximum}`
}

/** The bounds in a range text; an invalid bound is NaN. */
function bounds(range: string): Pick<MaskParameter, 'minimum' | 'above' | 'maximum'> {
  const limits = { minimum: null, above: null, maximum: null } as {
    minimum: number | null
    above: number | null
    maximum: number | null
  }
  const [low = '', high] = range.split(/…|\.\.+/).map((part) => part.trim())
  for (const part of high === undefined ? [low] : [low, high && `<=${high.replace(/^<=/, '')}`]) {
    const [, sign = '', number = ''] = /^(>=|>|<=|)\s*(.*)$/.exec(part) ?? []
    if (!number) continue
    if (sign === '<=') limits.maximum = Number(number)
    else if (sign === '>') limits.above = Number(number)
    else limits.minimum = Number(number)
  }
  return limits
}

/** Whether parameters of a type have bounds. */
const typeHasRange = (kind: Row['kind']): boolean =>
  kind === 'number' || kind === 'array' || kind === 'integer'
const hasValidRange = ({ kind, range }: Row): boolean =>
  !typeHasRange(kind) || !Object.values(bounds(range)).some(Number.isNaN)

function declared({ was, name, kind, value, unit, range, doc }: Row): MaskParameter {
  const typeFields =
    kind === 'choice'
      ? {
          choices: range
            .split(',')
            .map((word) => word.trim())
            .filter(Boolean),
        }
      : typeHasRange(kind)
        ? { ...bounds(range), unit: unit.trim() }
        : {}
  return {
    was,
    name: name.trim(),
    kind,
    default: kind === 'choice' ? value.trim() : value,
    doc: doc.trim(),
    ...typeFields,
  }
}
