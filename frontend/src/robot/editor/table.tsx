import { Menu, Tooltip } from '@mantine/core'
import { IconAlertTriangle, IconDotsVertical } from '@tabler/icons-react'
import { memo, useRef, useState } from 'react'
import { newKey } from '../../keys'
import type { CellColumn, LinkRow, RobotFinding } from '../../protocol'
import { cellText, edit, isAngle, unitOf, useRobotEditor, type Angles, type OpenRobot } from './state'

interface Fault {
  what: string
  fix: string
}

/** One of the two tables: a row for each link, a column for each editable value. */
export function LinkTable({
  shown,
  columns,
  actions,
}: {
  shown: OpenRobot
  columns: CellColumn[]
  actions: boolean
}) {
  const angles = useRobotEditor((s) => s.angles)
  const groups = grouped(columns)
  return (
    <div className="robot-table" onKeyDown={moveBetweenRows}>
      <table aria-label="Links">
        <thead>
          <tr>
            <th rowSpan={2} scope="col" className="row-name">
              link
            </th>
            {groups.map(({ name, span }, k) => (
              <th key={k} colSpan={span} scope="colgroup" className={k ? 'first' : undefined}>
                {name}
              </th>
            ))}
            {actions && <th rowSpan={2} aria-label="Row" />}
          </tr>
          <tr>
            {columns.map((column, k) => (
              <th
                key={column.name}
                scope="col"
                title={column.doc}
                className={startsGroup(columns, k) ? 'first' : undefined}
                style={{ minWidth: columnWidth(shown.links, column, angles) }}
              >
                {column.title}{' '}
                <span className="unit">{unitOf(column, angles, commonJointType(shown.links))}</span>
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {shown.links.map((link, row) => (
            <tr key={row}>
              <th scope="row" className="row-name">
                <NameCell
                  link={link}
                  findings={shown.findings.filter((finding) => finding.link === link.name)}
                />
              </th>
              {columns.map((column, k) => (
                <td key={column.name} className={startsGroup(columns, k) ? 'first' : undefined}>
                  <Cell
                    owner={link.name}
                    turns={link.turns}
                    value={link.cells[column.name] ?? null}
                    column={column}
                    angles={angles}
                    locked={link.locked[column.name]}
                    symbol={column.name === link.variable ? 'q' : ''}
                    finding={shown.findings.find(
                      (finding) => finding.link === link.name && finding.columns.includes(column.name),
                    )}
                  />
                </td>
              ))}
              {actions && (
                <td className="row-menu">
                  <RowMenu link={link} row={row} shown={shown} />
                </td>
              )}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}

function grouped(columns: CellColumn[]): { name: string; span: number }[] {
  const groups: { name: string; span: number }[] = []
  for (const { group } of columns) {
    const last = groups.at(-1)
    if (last?.name === group) last.span++
    else groups.push({ name: group, span: 1 })
  }
  return groups
}

const startsGroup = (columns: CellColumn[], k: number) => k > 0 && columns[k]!.group !== columns[k - 1]!.group

const LETTER_PX = 7.3
const PADDING_PX = 4

/** Width of the longest text in a column, px (the padding of the header is added). */
function columnWidth(links: LinkRow[], column: CellColumn, angles: Angles): number {
  const longest = Math.max(
    ...links.map(({ cells, turns }) => cellText(cells[column.name], isAngle(column, turns), angles).length),
  )
  return Math.round(longest * LETTER_PX + PADDING_PX)
}

/** Whether all joints are revolute or all are prismatic; undefined for mixed types. */
function commonJointType(links: LinkRow[]): boolean | undefined {
  const jointTypes = new Set(links.filter(({ moves }) => moves).map(({ turns }) => turns))
  return jointTypes.size === 1 ? [...jointTypes][0] : undefined
}

/** Up, Down and Enter move between rows; the browser handles Tab. */
function moveBetweenRows(event: React.KeyboardEvent): void {
  const step = { ArrowUp: -1, ArrowDown: 1, Enter: event.shiftKey ? -1 : 1 }[event.key]
  const field = event.target
  if (!step || !(field instanceof HTMLInputElement)) return
  const row = field.closest('tr')
  const next = (step > 0 ? row?.nextElementSibling : row?.previousElementSibling) as
    HTMLTableRowElement | null | undefined
  const cellIndex = field.closest<HTMLTableCellElement>('td, th')?.cellIndex
  const target = cellIndex === undefined ? undefined : next?.cells[cellIndex]?.querySelector('input')
  event.preventDefault()
  if (target) target.focus()
  else field.blur()
}

function NameCell({ link, findings }: { link: LinkRow; findings: RobotFinding[] }) {
  const messages = findings.map(({ what, fix }) => `${what} ${fix}`).join('\n')
  return (
    <span className="name-cell">
      <TextCell
        label={`name of ${link.name}`}
        text={link.name}
        send={(name) => edit({ kind: 'rename_link', link: link.name, name })}
        sendOnBlur
      />
      {messages && (
        <Tooltip label={messages} multiline w={320}>
          <IconAlertTriangle size={14} className="warn" role="img" aria-label={messages} tabIndex={0} />
        </Tooltip>
      )}
    </span>
  )
}

interface CellProps {
  /** Name of the link; empty for the robot itself. */
  owner: string
  turns: boolean
  value: number | string | null
  column: CellColumn
  angles: Angles
  locked?: string | undefined
  symbol?: string
  finding?: RobotFinding | undefined
}

/** One cell: typing changes the arm at once, and errors are displayed at the cell. */
export const Cell = memo(function Cell({
  owner,
  turns,
  value,
  column,
  angles,
  locked,
  symbol = '',
  finding,
}: CellProps) {
  const label = `${column.title} of ${owner || column.group || 'the robot'}`
  if (locked)
    return (
      <span className="cell locked" title={locked} aria-label={`${label}: ${locked}`}>
        {symbol && (
          <i>
            {symbol[0]}
            <sub>{symbol.slice(1)}</sub>
          </i>
        )}
      </span>
    )
  const send = (text: string, gesture: string) =>
    edit({ kind: 'cell', link: owner, column: column.name, text, angles }, gesture)
  if (column.quantity === 'choice')
    return (
      <select
        className="cell choice"
        aria-label={label}
        value={String(value)}
        onChange={(event) => void send(event.currentTarget.value, '')}
      >
        {column.choices.map((choice) => (
          <option key={choice}>{choice}</option>
        ))}
      </select>
    )
  return (
    <TextCell
      label={label}
      text={cellText(value, isAngle(column, turns), angles)}
      doc={`${column.doc}${unitOf(column, angles, turns) ? `, ${unitOf(column, angles, turns)}` : ''}`}
      send={send}
      marked={finding}
      wide={column.quantity === 'text'}
    />
  )
})

interface TextCellProps {
  label: string
  text: string
  doc?: string
  send: (text: string, gesture: string) => Promise<Fault | undefined>
  marked?: Fault | undefined
  wide?: boolean
  /** Sent once, when the cell loses the focus, because a partial text would have another meaning. */
  sendOnBlur?: boolean
}

function TextCell({ label, text, doc, send, marked, wide, sendOnBlur }: TextCellProps) {
  const [typed, setTyped] = useState<string | null>(null)
  const [fault, setFault] = useState<Fault | null>(null)
  const [focused, setFocused] = useState(false)
  const gesture = useRef('')
  const textAtFocus = useRef(text)
  const lastRequest = useRef(0)
  const sendText = async (value: string) => {
    const request = ++lastRequest.current
    const refusal = await send(value, gesture.current)
    if (request !== lastRequest.current) return false
    setFault(refusal ?? null)
    return !refusal
  }
  const commit = async () => {
    if (typed === null) return
    const accepted = (sendOnBlur && typed !== text) || fault ? await sendText(typed) : true
    if (accepted) setTyped(null)
  }
  const tip = fault
    ? `${fault.what}${fault.fix ? `. ${fault.fix}` : ''}`
    : marked
      ? `${marked.what} ${marked.fix}`
      : ''
  return (
    <Tooltip
      label={tip}
      opened={Boolean(tip) && focused}
      multiline
      w={280}
      position="bottom"
      {...(fault ? { color: 'red.9' } : {})}
      withArrow
    >
      <input
        className={`cell${wide ? ' wide' : ''}${fault ? ' wrong' : marked ? ' marked' : ''}`}
        aria-label={label}
        aria-invalid={Boolean(fault)}
        aria-description={tip || doc}
        title={focused ? undefined : tip || doc}
        spellCheck={false}
        autoComplete="off"
        value={typed ?? text}
        onFocus={(event) => {
          gesture.current = newKey()
          textAtFocus.current = text
          setFocused(true)
          event.currentTarget.select()
        }}
        onChange={(event) => {
          setTyped(event.currentTarget.value)
          if (!sendOnBlur) void sendText(event.currentTarget.value)
        }}
        onBlur={() => {
          setFocused(false)
          void commit()
        }}
        onKeyDown={(event) => {
          if (event.key !== 'Escape') return
          event.stopPropagation()
          if (typed === null) event.currentTarget.blur()
          else if (!sendOnBlur) void sendText(textAtFocus.current)
          setTyped(null)
          setFault(null)
        }}
      />
    </Tooltip>
  )
}

function RowMenu({ link, row, shown }: { link: LinkRow; row: number; shown: OpenRobot }) {
  return (
    <Menu position="bottom-end" shadow="md">
      <Menu.Target>
        <button type="button" className="dots" aria-label={`Joint ${link.name}`}>
          <IconDotsVertical size={14} />
        </button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item onClick={() => void edit({ kind: 'add_joint', after: link.name })}>
          Insert a joint after it
        </Menu.Item>
        {row === 0 && (
          <Menu.Item onClick={() => void edit({ kind: 'add_joint', after: '' })}>
            Insert a joint before it
          </Menu.Item>
        )}
        <Menu.Item
          disabled={!shown.chain || row === 0}
          onClick={() => void edit({ kind: 'move_joint', link: link.name, by: -1 })}
        >
          Move towards the base
        </Menu.Item>
        <Menu.Item
          disabled={!shown.chain || row === shown.links.length - 1}
          onClick={() => void edit({ kind: 'move_joint', link: link.name, by: 1 })}
        >
          Move towards the tool
        </Menu.Item>
        <Menu.Item
          color="red"
          disabled={shown.links.length === 1}
          onClick={() => void edit({ kind: 'remove_joint', link: link.name })}
        >
          Remove the joint
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  )
}
