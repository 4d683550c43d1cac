import './parameter_sets_dialog.css'
import { ActionIcon, Button, Checkbox, Group, Menu, Modal, Text, TextInput, Tooltip } from '@mantine/core'
import { IconAlertTriangle, IconDots, IconTrash } from '@tabler/icons-react'
import { useState } from 'react'
import { showDialog, useDialogs } from '../dialogs'
import { valueText } from '../inspector/value_text'
import { newKey } from '../keys'
import type { Edit } from '../messages'
import { activeSet, refusalReason, setNames, setRows, type Cell, type Row } from '../model/parameter_sets'
import type { ParameterSetTable } from '../protocol'
import { ask, useStudio } from '../store'
import { useRuns } from './runs'
import { setTrialValues } from './trial_values'
import { useParameterSets } from './use_parameter_sets'

/** Named values of parameters that are saved with the model: save, try, apply, compare, rename, remove. */
export function ParameterSets() {
  const opened = useDialogs((s) => s.open === 'parameter_sets')
  return (
    <Modal
      opened={opened}
      onClose={() => showDialog(null)}
      closeButtonProps={{ 'aria-label': 'Close' }}
      title={<b>Parameter sets</b>}
      size={860}
    >
      {opened && <Content />}
    </Modal>
  )
}

/** Apply an edit to the whole model. Returns whether it was accepted; a refusal is shown as a notice. */
async function applyToModel(edit: Edit): Promise<boolean> {
  const document = useStudio.getState().document?.state.document
  if (document === undefined) return false
  return (await ask({ kind: 'change', document, key: newKey(), inside: [], edit })) !== undefined
}

/** Write a set into the model, as one undo step; a run in progress gets its values as well. */
async function putIntoModel(table: ParameterSetTable, name: string): Promise<void> {
  if (refusalReason(table, name, true) === undefined) await setTrialValues(table.sets[name]!)
  if (await applyToModel({ kind: 'apply_parameter_set', name })) useRuns.setState({ trialValues: {} })
}

function Content() {
  const table = useParameterSets()
  if (!table) return <Text size="sm">Loading the parameter sets …</Text>
  return (
    <div className="parameter-sets">
      <SaveForm table={table} />
      {Object.keys(table.sets).length > 0 && <Comparison table={table} />}
    </div>
  )
}

function SaveForm({ table }: { table: ParameterSetTable }) {
  const trialValues = useRuns((s) => s.trialValues)
  const [name, setName] = useState('')
  const [complete, setComplete] = useState(true)
  const tried = Object.keys(trialValues).length
  const ofSets = new Set(Object.values(table.sets).flatMap((values) => Object.keys(values)))
  const others = [...ofSets].filter((path) => !(path in trialValues)).length
  const otherValues =
    others === 1 ? 'value of the other parameter' : `values of the ${others} other parameters`
  const count = tried + (complete ? others : 0)
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        if (!name.trim() || !count) return
        const edit = { kind: 'save_parameter_set' as const, name: name.trim(), values: trialValues }
        void applyToModel({ ...edit, all_parameters: complete }).then((done) => done && setName(''))
      }}
    >
      <Group gap="xs" align="end" wrap="nowrap">
        <TextInput
          label="Name of a new set"
          size="sm"
          flex={1}
          data-autofocus
          autoFocus // the sets are loaded after the dialog has taken the focus
          value={name}
          maxLength={200}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Button type="submit" size="sm" disabled={!name.trim() || !count}>
          Save {count === 1 ? 'one value' : `${count} values`}
        </Button>
      </Group>
      <Text size="xs" c="dimmed" mt={6}>
        {tried
          ? `The set contains the ${tried === 1 ? 'tried value' : `${tried} tried values`}.`
          : 'No values are tried: change parameters in the panel Tune first.'}
      </Text>
      {others > 0 && (
        <Checkbox
          mt={6}
          size="xs"
          checked={complete}
          onChange={(event) => setComplete(event.currentTarget.checked)}
          label={
            `Also the model’s ${otherValues} ` +
            'of the sets below, so that the order in which sets are applied to the model does not matter'
          }
        />
      )}
    </form>
  )
}

function Comparison({ table }: { table: ParameterSetTable }) {
  const trialValues = useRuns((s) => s.trialValues)
  const [onlyVarying, setOnlyVarying] = useState(false)
  const [renaming, setRenaming] = useState('')
  const names = setNames(table)
  const contained = new Set(Object.values(table.sets).flatMap((values) => Object.keys(values)))
  const rows = setRows(table, names).filter(({ path }) => contained.has(path))
  const shown = onlyVarying ? rows.filter(({ varies }) => varies) : rows
  const active = activeSet(table, trialValues)
  return (
    <>
      <div className="set-table" tabIndex={0} role="region" aria-label="Values of the parameter sets">
        <table className="numbers">
          <thead>
            <tr>
              <th scope="col">Parameter</th>
              <th scope="col">Model</th>
              {names.map((name) => (
                <th key={name} scope="col" className={name === active ? 'active' : ''}>
                  {renaming === name ? (
                    <NewName name={name} onClose={() => setRenaming('')} />
                  ) : (
                    <SetHead table={table} name={name} active={name === active} rename={setRenaming} />
                  )}
                </th>
              ))}
              <th aria-label="Remove" />
            </tr>
          </thead>
          <tbody>
            {shown.map((row) => (
              <ValueRow key={row.path} row={row} names={names} />
            ))}
          </tbody>
        </table>
      </div>
      <Group justify="space-between" mt="xs">
        <Text size="xs" c="dimmed">
          Bold values differ from the model. Grey values are those of the model: the set does not contain
          them.
        </Text>
        {names.length > 1 && (
          <Checkbox
            size="xs"
            label="Only parameters in which the sets differ"
            checked={onlyVarying}
            onChange={(event) => setOnlyVarying(event.currentTarget.checked)}
          />
        )}
      </Group>
    </>
  )
}

interface HeadProps {
  table: ParameterSetTable
  name: string
  active: boolean
  rename: (name: string) => void
}

/** The name of a set, the button that tries it, and the menu of its other commands. */
function SetHead({ table, name, active, rename }: HeadProps) {
  const trialValues = useRuns((s) => s.trialValues)
  const noTrial = refusalReason(table, name, true)
  const invalid = refusalReason(table, name, false)
  const apply = () => void setTrialValues(active ? {} : table.sets[name]!)
  return (
    <div className="set-head">
      <span className="set-name" title={name}>
        {name}
      </span>
      <Group gap={2} wrap="nowrap">
        <Tooltip
          label={noTrial ?? (active ? 'Back to the values of the model' : 'Try the values of this set')}
        >
          <Button
            size="compact-xs"
            variant={active ? 'filled' : 'default'}
            aria-label={`Try ${name}`}
            aria-pressed={active}
            data-disabled={noTrial !== undefined || undefined}
            onClick={() => noTrial === undefined && apply()}
          >
            {active ? 'Tried' : 'Try'}
          </Button>
        </Tooltip>
        <Menu position="bottom-end" shadow="md">
          <Menu.Target>
            <ActionIcon size="sm" variant="subtle" color="gray" aria-label={`Commands for ${name}`}>
              <IconDots size={14} />
            </ActionIcon>
          </Menu.Target>
          <Menu.Dropdown className="context-menu">
            <Menu.Item
              disabled={invalid !== undefined}
              title={invalid ?? ''}
              onClick={() => void putIntoModel(table, name)}
            >
              Put into the model
            </Menu.Item>
            <Menu.Item
              disabled={!Object.keys(trialValues).length || active}
              onClick={() =>
                void applyToModel({
                  kind: 'save_parameter_set',
                  name,
                  values: { ...table.sets[name], ...trialValues },
                  replace: true,
                })
              }
            >
              Update with the tried values
            </Menu.Item>
            <Menu.Item onClick={() => rename(name)}>Rename</Menu.Item>
            <Menu.Divider />
            <Menu.Item onClick={() => void applyToModel({ kind: 'remove_parameter_set', name })}>
              Remove
            </Menu.Item>
          </Menu.Dropdown>
        </Menu>
      </Group>
    </div>
  )
}

function NewName({ name, onClose }: { name: string; onClose: () => void }) {
  const [typed, setTyped] = useState(name)
  const accept = () => {
    const to = typed.trim()
    if (!to || to === name) onClose()
    else void applyToModel({ kind: 'rename_parameter_set', name, to }).then((done) => done && onClose())
  }
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        accept()
      }}
    >
      <TextInput
        size="xs"
        w={120}
        autoFocus
        maxLength={200}
        aria-label={`New name of ${name}`}
        data-mantine-stop-propagation // Escape closes the field, not the dialog
        value={typed}
        onChange={(event) => setTyped(event.currentTarget.value)}
        onBlur={onClose}
        onKeyDown={(event) => {
          if (event.key !== 'Escape') return
          event.stopPropagation()
          onClose()
        }}
      />
    </form>
  )
}

function ValueRow({ row, names }: { row: Row; names: string[] }) {
  return (
    <tr>
      <th scope="row" title={row.doc}>
        <span className="path">{row.path}</span>
        {row.unit && <span className="unit"> {row.unit}</span>}
      </th>
      <td>{row.model === null ? '–' : valueText(row.model)}</td>
      {row.cells.map((cell, k) => (
        <ValueCell key={names[k]} cell={cell} />
      ))}
      <td>
        <Tooltip label="Remove from all sets">
          <ActionIcon
            size="xs"
            variant="subtle"
            color="gray"
            aria-label={`Remove ${row.path} from all sets`}
            onClick={() => void applyToModel({ kind: 'remove_set_parameter', path: row.path })}
          >
            <IconTrash size={13} />
          </ActionIcon>
        </Tooltip>
      </td>
    </tr>
  )
}

function ValueCell({ cell: { value, inherited, differs, fault } }: { cell: Cell }) {
  const text = value === null ? '–' : valueText(value)
  return (
    <td className={inherited ? 'inherited' : differs ? 'differs' : ''}>
      {fault ? (
        <Tooltip label={fault}>
          <span className="fault">
            <IconAlertTriangle size={12} aria-label={fault} /> {text}
          </span>
        </Tooltip>
      ) : (
        text
      )}
    </td>
  )
}
