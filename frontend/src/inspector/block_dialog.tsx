import { Button, Code, Group, Modal, NativeSelect, Stack, Switch, Text, TextInput } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { Refusal } from '../connection'
import type { ParameterRule, SheetBlock } from '../protocol'
import { change, connection, openSheet, useStudio } from '../store'
import { openMask } from '../dialogs'
import { startOrResume } from '../run/start'
import { FunctionField } from './function_field'
import { TableField, tableRows, tableText } from './table_field'
import { valueText } from './value_text'

const CHECK_DELAY_MS = 200

/**
 * The parameters of a block, generated from its declaration: name, unit, allowed values, description.
 */
export function BlockDialog() {
  const name = useStudio((s) => s.editing)
  const block = useStudio((s) => (s.editing ? s.document?.blocks[s.editing] : undefined))
  const edit = useStudio((s) => s.edit)
  if (!name || !block) return null
  return <Dialog key={name} block={block} onClose={() => edit(null)} />
}

function Dialog({ block, onClose }: { block: SheetBlock; onClose: () => void }) {
  const blockType = useStudio((s) => s.library.get(block.type))
  useReturnedFocus()
  const rules = useMemo(() => [...(blockType?.parameters ?? []), ...block.mask], [block, blockType])
  const initialTexts = useMemo(
    () =>
      Object.fromEntries(
        rules.map((rule) => [rule.name, block.formulas[rule.name] ?? textOf(rule, valueOf(block, rule))]),
      ),
    [block, rules],
  )
  const [typed, setTyped] = useState<Record<string, string>>(initialTexts)
  const [faults, setFaults] = useState<Record<string, string>>({})
  if (!blockType) return null
  const changed = rules.filter(({ name }) => typed[name] !== initialTexts[name])
  const invalid = Object.values(faults).some(Boolean)
  const apply = async () => {
    if (invalid) return false
    if (!changed.length) return true
    const values = Object.fromEntries(
      changed.map((rule) => [rule.name, sentValue(rule, typed[rule.name] ?? '', block)]),
    )
    return (await change({ kind: 'parameters', block: block.name, values })) !== undefined
  }
  const [summary, ...rest] = blockType.documentation.split('\n\n')
  return (
    <Modal
      opened
      onClose={onClose}
      // An accidental click beside the dialog does not discard typed values.
      closeOnClickOutside={!changed.length}
      title={
        <Group gap="xs">
          <b>{block.name}</b>
          <Text size="sm" c="dimmed">
            {blockType.title}
          </Text>
        </Group>
      }
      size={rules.some(namesFile) ? 720 : block.opens ? 580 : 'md'}
    >
      <form
        onSubmit={(event) => {
          event.preventDefault()
          void apply().then((done) => done && onClose())
        }}
        onKeyDown={(event) => {
          if (event.key !== 'Enter' || !(event.ctrlKey || event.metaKey) || event.shiftKey) return
          // Ctrl+Enter runs the model with the typed values.
          event.preventDefault()
          event.stopPropagation()
          void apply().then((done) => done && startOrResume())
        }}
      >
        <Stack gap="sm">
          <Text size="sm">{summary}</Text>
          <MoreDocumentation paragraphs={rest} />
          {rules.map((rule, index) => (
            <Field
              key={rule.name}
              rule={rule}
              block={block}
              text={typed[rule.name] ?? ''}
              initial={initialTexts[rule.name] ?? ''}
              focus={index === 0}
              onText={(text) => setTyped((now) => ({ ...now, [rule.name]: text }))}
              onFault={(fault) =>
                setFaults((now) => (now[rule.name] === fault ? now : { ...now, [rule.name]: fault }))
              }
            />
          ))}
          {rules.length === 0 && <Text size="sm">This block has no parameters.</Text>}
          <Actions {...{ block, invalid, apply, onClose }} changed={changed.length > 0} />
        </Stack>
      </form>
    </Modal>
  )
}

/** When the dialog closes, return the focus to the element that had it when the dialog opened. */
function useReturnedFocus(): void {
  const [previousFocus] = useState(() => document.activeElement)
  useEffect(
    () => () => {
      if (previousFocus instanceof HTMLElement) previousFocus.focus({ preventScroll: true })
    },
    [previousFocus],
  )
}

function MoreDocumentation({ paragraphs }: { paragraphs: string[] }) {
  if (!paragraphs.length) return null
  return (
    <details className="more">
      <summary>More</summary>
      {paragraphs.map((paragraph) => (
        <Text key={paragraph} size="sm" className="paragraph">
          {paragraph}
        </Text>
      ))}
    </details>
  )
}

interface ActionsProps {
  block: SheetBlock
  invalid: boolean
  changed: boolean
  apply: () => Promise<boolean>
  onClose: () => void
}

function Actions({ block, invalid, changed, apply, onClose }: ActionsProps) {
  return (
    <Group justify="flex-end" gap="xs" className="dialog-actions">
      {block.opens && (
        <Group gap={0} mr="auto">
          <Button
            variant="subtle"
            px="xs"
            onClick={() => (
              onClose(),
              openSheet([...(useStudio.getState().document?.inside ?? []), block.name])
            )}
          >
            Look under the mask
          </Button>
          {!block.link && (
            <Button variant="subtle" px="xs" onClick={() => (onClose(), openMask(block.name))}>
              Edit the mask
            </Button>
          )}
        </Group>
      )}
      <Button variant="default" onClick={onClose}>
        Cancel
      </Button>
      <Button variant="default" disabled={invalid || !changed} onClick={() => void apply()}>
        Apply
      </Button>
      <Button type="submit" disabled={invalid}>
        OK
      </Button>
    </Group>
  )
}

interface FieldProps {
  rule: ParameterRule
  block: SheetBlock
  text: string
  initial: string
  focus: boolean
  onText: (text: string) => void
  onFault: (fault: string) => void
}

function Field({ rule, block, text, initial, focus, onText, onFault }: FieldProps) {
  const robots = useStudio((s) => s.welcome?.robots)
  const files = useStudio((s) => s.welcome?.files)
  const { fault, value } = useCheck(rule, block, text, onFault)
  const label = (
    <>
      {rule.name}
      {rule.unit && <span className="unit"> {rule.unit}</span>}
    </>
  )
  const fieldProps = {
    label,
    description: rule.doc,
    size: 'sm' as const,
    'data-autofocus': focus || undefined,
  }
  const formula = rule.name in block.formulas
  if (rule.kind === 'boolean' && !formula)
    return (
      <Switch
        label={label}
        description={rule.doc}
        checked={text === 'true'}
        onChange={(event) => onText(String(event.currentTarget.checked))}
      />
    )
  if (rule.kind === 'choice' && !formula)
    return (
      <NativeSelect
        {...fieldProps}
        data={rule.choices}
        value={text}
        onChange={(event) => onText(event.currentTarget.value)}
      />
    )
  if (rule.kind === 'robot' && !formula) {
    const robotFiles = [...(robots ?? []), ...(files ?? [])]
    return (
      <NativeSelect
        {...fieldProps}
        data={robotFiles.includes(text) ? robotFiles : [text, ...robotFiles]}
        value={text}
        onChange={(event) => onText(event.currentTarget.value)}
      />
    )
  }
  if (rule.kind === 'table') {
    const rows = tableRows(valueOf(block, rule))
    return <TableField {...{ rule, text, rows, focus, onText, onFault }} />
  }
  if (rule.kind === 'function') return <FunctionField {...{ rule, block, text, initial, focus, onText }} />
  return (
    <TextInput
      {...fieldProps}
      value={text}
      onChange={(event) => onText(event.currentTarget.value)}
      error={fault || undefined}
      rightSection={value && value !== text && <Code className="meaning">= {value}</Code>}
      rightSectionWidth={value && value !== text ? 16 + 7.2 * (value.length + 2) : undefined}
      classNames={{ input: 'typed' }}
    />
  )
}

/** The server's evaluation of a text while it is typed: its value, or the error. */
function useCheck(rule: ParameterRule, block: SheetBlock, text: string, onFault: (fault: string) => void) {
  const [state, setState] = useState({ fault: '', value: '' })
  useEffect(() => {
    if (
      ['boolean', 'choice', 'robot', 'table', 'function'].includes(rule.kind) &&
      !(rule.name in block.formulas)
    )
      return
    let current = true
    const report = (fault: string, value: string) => {
      if (!current) return
      setState({ fault, value })
      onFault(fault)
    }
    const timer = setTimeout(() => {
      const { document } = useStudio.getState()
      const where = { document: document?.state.document, inside: document?.inside, block: block.name }
      connection.ask({ kind: 'typed', ...where, type: block.type, parameter: rule.name, text }).then(
        (value) => report('', valueText(value)),
        (error: unknown) =>
          error instanceof Refusal && report(`${error.what}. Allowed: ${error.allowed}`, ''),
      )
    }, CHECK_DELAY_MS)
    return () => {
      current = false
      clearTimeout(timer)
    }
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [text])
  return state
}

/** The value of a parameter in the request. */
function sentValue(rule: ParameterRule, text: string, { formulas }: SheetBlock): unknown {
  // An empty text is the default: rows in the diagram, or the function of a new block.
  if (namesFile(rule)) return text ? (rule.kind === 'table' ? JSON.parse(text) : text) : null
  return rule.kind === 'boolean' && !(rule.name in formulas) ? text === 'true' : text
}

const namesFile = ({ kind }: ParameterRule): boolean => kind === 'table' || kind === 'function'

function textOf(rule: ParameterRule, value: unknown): string {
  if (rule.kind === 'table') return tableText(value)
  if (rule.kind === 'function') return (value as { source: string }).source
  return valueText(value)
}

/** The origin of a parameter: the block, or its mask. */
function valueOf(block: SheetBlock, rule: ParameterRule): unknown {
  return block.mask.includes(rule) ? rule.default : block.parameters[rule.name]
}
