import { Alert, Checkbox, Group, NativeSelect, Stack, Table, Text } from '@mantine/core'
import { useEffect, useState } from 'react'
import { Refusal } from '../connection'
import type { ParameterRule, TableColumn, TablePreview } from '../protocol'
import { connection } from '../store'
import { withColumnNames, type TableChoice } from '../canvas/table_choice'
import { DataFileSelect } from './data_file_select'
import { TablePlot, traceTone } from './table_plot'

interface Props {
  rule: ParameterRule
  /** The choice as JSON, or `''` for rows that the diagram contains. */
  text: string
  /** Description of the rows that the diagram contains. */
  rows: string
  focus: boolean
  onText: (text: string) => void
  onFault: (fault: string) => void
}

/** The text of a value from the server: the choice as JSON, or `''` for rows in the diagram. */
export function tableText(value: unknown): string {
  const { source, time, columns } = value as { source: string; time: string; columns: string[] }
  return source ? JSON.stringify({ file: source, time, columns } satisfies TableChoice) : ''
}

/** The description of the rows of a value from the server. */
export const tableRows = (value: unknown): string => (value as { table: string }).table

/** A parameter that takes its values from the columns of a file of the project folder. */
export function TableField({ rule, text, rows, focus, onText, onFault }: Props) {
  const choice = text ? (JSON.parse(text) as TableChoice) : null
  const [initial] = useState(text)
  const { preview, refusal, stale } = usePreview(text)
  const fault = refusal ?? preview?.fault ?? null
  useEffect(() => {
    onFault(fault && text !== initial ? fault.what : '')
    // The callback is new at every rendering.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [fault, text, initial])
  useEffect(() => {
    const named = choice && preview && !stale ? withColumnNames(choice, preview) : choice
    if (named && named !== choice) onText(JSON.stringify(named))
    // The callback is new at every rendering.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [preview, stale, text])
  const choose = (changed: Partial<TableChoice>) =>
    choice && onText(JSON.stringify({ ...choice, ...changed }))
  return (
    <Stack gap="xs" className="data-field">
      <DataFileSelect
        holds="table"
        label={rule.name}
        description={choice ? rule.doc : `${rule.doc}; now ${rows} in the diagram`}
        file={choice?.file ?? ''}
        focus={focus}
        onFile={(file) => onText(JSON.stringify({ file, time: '', columns: [] } satisfies TableChoice))}
      />
      {fault && (
        <Alert color="red" variant="light" p="xs" role="alert">
          <Text size="sm">{fault.what}.</Text>
          <Text size="xs" c="dimmed">
            {fault.fix}
          </Text>
        </Alert>
      )}
      {preview && choice && <Columns preview={preview} choice={choice} choose={choose} />}
      {preview && preview.count > 0 && <Preview preview={preview} />}
    </Stack>
  )
}

/** The preview of a choice; the previous preview is shown until the next one arrives. */
function usePreview(text: string) {
  const [state, setState] = useState<{ of: string; preview: TablePreview | null; refusal: Refusal | null }>({
    of: '',
    preview: null,
    refusal: null,
  })
  useEffect(() => {
    if (!text) return
    let current = true
    connection.ask({ kind: 'preview_table', ...(JSON.parse(text) as TableChoice) }).then(
      (preview) => current && setState({ of: text, preview, refusal: null }),
      (error: unknown) => {
        if (error instanceof Refusal && current) setState({ of: text, preview: null, refusal: error })
      },
    )
    return () => {
      current = false
    }
  }, [text])
  return { ...state, stale: state.of !== text }
}

interface ColumnsProps {
  preview: TablePreview
  choice: TableChoice
  choose: (changed: Partial<TableChoice>) => void
}

/** The choice of the columns of times and of values. */
function Columns({ preview, choice, choose }: ColumnsProps) {
  const { columns, time } = preview
  // A click is shown before the preview of the new choice has arrived.
  const chosen = choice.columns.length ? choice.columns : preview.chosen
  const usable = columns.filter((column) => !column.fault)
  const values = columns.filter((column) => column.name !== time)
  const toggle = (name: string) => {
    const names = new Set(chosen)
    if (!names.delete(name)) names.add(name)
    // The columns have the order of the file.
    choose({ time, columns: values.filter((column) => names.has(column.name)).map((column) => column.name) })
  }
  return (
    <>
      <NativeSelect
        label="Times"
        description="the column of times, s"
        size="sm"
        data={usable.map((column) => ({ value: column.name, label: titleOf(column) }))}
        value={time}
        onChange={(event) => choose({ time: event.currentTarget.value, columns: [] })}
      />
      <fieldset className="data-columns">
        <legend>
          Values
          {choice.columns.length > 0 && (
            <button type="button" onClick={() => choose({ columns: [] })}>
              all columns
            </button>
          )}
        </legend>
        {values.map((column) => (
          <Checkbox
            key={column.name}
            size="xs"
            label={
              <>
                <Swatch curve={preview.chosen.slice(0, preview.curves.length).indexOf(column.name)} />
                {titleOf(column)}
              </>
            }
            description={column.fault || undefined}
            disabled={(column.fault !== '' || column.kind === 'date') && !chosen.includes(column.name)}
            checked={chosen.includes(column.name)}
            onChange={() => toggle(column.name)}
          />
        ))}
      </fieldset>
    </>
  )
}

/** The name, with the unit if the name does not contain it, and the type of a column without numbers. */
function titleOf({ name, unit, kind }: TableColumn): string {
  const title = unit && !name.includes(unit) ? `${name} [${unit}]` : name
  return kind === 'number' ? title : `${title} (${kind})`
}

/** The colour of a column's curve in the plot; nothing for a column without a curve. */
function Swatch({ curve }: { curve: number }) {
  if (curve < 0) return null
  return <i className="data-swatch" style={{ background: `var(--${traceTone(curve)})` }} aria-hidden />
}

/** Plot, first rows, and notes on the interpretation of the file. */
function Preview({ preview }: { preview: TablePreview }) {
  const { time, chosen, rows, count, spacing, times, notes } = preview
  const columnCount = rows[0]?.length ?? 0
  const [shortest, longest] = spacing
  const step =
    longest - shortest < 1e-6 * longest
      ? `every ${sixDigits(longest)} s`
      : `every ${sixDigits(shortest)} to ${sixDigits(longest)} s`
  return (
    <>
      <TablePlot preview={preview} />
      <Text size="xs" c="dimmed">
        {count} rows from {sixDigits(times[0]!)} s to {sixDigits(times.at(-1)!)} s, {step}
        {chosen.length > columnCount - 1 &&
          `; the first ${columnCount - 1} of ${chosen.length} columns are shown`}
      </Text>
      <div className="data-rows" tabIndex={0} role="group" aria-label="First rows">
        <Table withRowBorders={false} verticalSpacing={1} horizontalSpacing={8}>
          <Table.Thead>
            <Table.Tr>
              {[time, ...chosen].slice(0, columnCount).map((name) => (
                <Table.Th key={name}>{name}</Table.Th>
              ))}
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {rows.map((row, number) => (
              <Table.Tr key={number}>
                {row.map((cell, column) => (
                  <Table.Td key={column}>{cell}</Table.Td>
                ))}
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </div>
      {notes.map((note) => (
        <Group key={note} gap={6} wrap="nowrap" align="baseline">
          <Text size="xs" c="dimmed">
            {note}
          </Text>
        </Group>
      ))}
    </>
  )
}

const sixDigits = (value: number): string => String(Number(value.toPrecision(6)))
