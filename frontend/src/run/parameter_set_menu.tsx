import { Button, Menu } from '@mantine/core'
import { IconChevronDown } from '@tabler/icons-react'
import { openParameterSets } from '../dialogs'
import { activeSet, refusalReason, setNames } from '../model/parameter_sets'
import { useRuns } from './runs'
import { setTrialValues } from './trial_values'
import { useParameterSets } from './use_parameter_sets'

/** Menu that chooses the values for the next run: a parameter set, or the values of the model. */
export function ParameterSetMenu() {
  const table = useParameterSets()
  const trialValues = useRuns((s) => s.trialValues)
  const tried = Object.keys(trialValues).length > 0
  const active = table && activeSet(table, trialValues)
  const shown = active ?? (tried ? 'Tried values' : 'Values of the model')
  const names = table ? setNames(table) : []
  return (
    <div className="set-menu">
      <Menu position="bottom-start" shadow="md" width="target">
        <Menu.Target>
          <Button
            size="compact-xs"
            variant="default"
            fw={400}
            justify="space-between"
            w={260}
            maw="100%"
            rightSection={<IconChevronDown size={13} />}
            aria-label={`Parameter set: ${shown}`}
          >
            {shown}
          </Button>
        </Menu.Target>
        <Menu.Dropdown className="context-menu" aria-label="Parameter sets">
          <Menu.CheckboxItem checked={!tried} closeMenuOnClick onChange={() => void setTrialValues({})}>
            Values of the model
          </Menu.CheckboxItem>
          {table &&
            names.map((name) => (
              <Menu.CheckboxItem
                key={name}
                checked={name === active}
                closeMenuOnClick
                disabled={refusalReason(table, name, true) !== undefined}
                title={refusalReason(table, name, true) ?? ''}
                onChange={() => void setTrialValues(table.sets[name]!)}
              >
                {name}
              </Menu.CheckboxItem>
            ))}
          <Menu.Divider />
          <Menu.Item onClick={openParameterSets}>
            {names.length ? 'Save, compare and edit sets …' : 'Save the tried values as a set …'}
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
    </div>
  )
}
