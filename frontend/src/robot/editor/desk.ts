import { create } from 'zustand'
import { Refusal } from '../../connection'
import type { ChangeOf, ContentOf, Edit, EventOf } from '../../messages'
import type { CellColumn, DocumentState, Readings, RobotContent, RobotTables } from '../../protocol'
import { alteration, ask, line } from '../../store'

/** A robot that this page shows or has shown, in the last state sent by the server. */
export interface OpenRobot extends RobotContent {
  state: DocumentState
}
export type Angles = 'deg' | 'rad'

/** Joint positions, speeds and accelerations on the page: rad, m and per second. */
export interface Joints {
  q: number[]
  qd: number[]
  qdd: number[]
}

interface Desk {
  /** Robots by the keys of their documents. */
  robots: Record<string, OpenRobot>
  /** The key of the robot in the editor; null while a diagram is displayed. */
  current: string | null
  tables: RobotTables | null
  joints: Record<string, Joints>
  readings: Readings | null
  /** Whether the latest read-outs belong to an earlier robot or configuration. */
  reading: boolean
  angles: Angles
  /** Warnings issued while the last opened file was read. */
  notes: string[]
}

/** The open robots, and the one in the editor. */
export const useDesk = create<Desk>(() => ({
  robots: {},
  current: null,
  tables: null,
  joints: {},
  readings: null,
  reading: false,
  angles: 'deg',
  notes: [],
}))

function put(state: DocumentState, content: RobotContent): void {
  const { robots, joints } = useDesk.getState()
  const robot = { ...content, state }
  const moving = content.links.filter(({ moves }) => moves)
  const before = joints[state.document]
  const fits = before && before.q.length === moving.length
  useDesk.setState({
    robots: { ...robots, [state.document]: robot },
    joints: fits ? joints : { ...joints, [state.document]: atRest(content) },
  })
  if (useDesk.getState().current === state.document) readSoon()
}

/** Add a robot that this page shows from now on. */
export function robotOpened(event: EventOf<'opened'>, content: ContentOf<'robot'>): void {
  put(event.state, content)
  if (event.in_front) toFront(event.state.document, event.notes)
}

/** Update a robot that has changed. */
export function robotChanged({ state }: EventOf<'changed'>, change: ChangeOf<'robot'>): void {
  put(state, change.content)
}

/** Display a robot that this page has loaded. */
export function toFront(robot: string, notes: string[] = []): void {
  useDesk.setState({ current: robot, notes, readings: null })
  if (!useDesk.getState().tables)
    void ask({ kind: 'robot_tables' }).then((tables) => tables && useDesk.setState({ tables }))
  readSoon()
}

/** Return to the diagram. */
export function leaveEditor(): void {
  useDesk.setState({ current: null, notes: [] })
}

/** Close a robot without unsaved edits. */
export async function closeRobot(robot: string): Promise<void> {
  if ((await ask({ kind: 'close', document: robot })) === undefined) return
  const { [robot]: _, ...robots } = useDesk.getState().robots
  useDesk.setState({ robots })
}

const PLACE = 'armblocks-robot'
type Name = Pick<DocumentState, 'document' | 'path' | 'origin'>

/** Store which robot this tab shows, so that a reload shows it again. */
useDesk.subscribe(({ robots, current }, before) => {
  if (robots === before.robots && current === before.current) return
  const shown = current ? robots[current] : undefined
  if (!shown) return sessionStorage.removeItem(PLACE)
  const { document, path, origin } = shown.state
  sessionStorage.setItem(PLACE, JSON.stringify({ document, path, origin }))
})

/**
 * After a reconnection or a reload, let the server reopen the robots of this page under the same keys.
 * Returns the key of the robot that the tab showed before a reload.
 */
export async function attachAgain(): Promise<string | undefined> {
  const { robots, current } = useDesk.getState()
  const last = current ? null : (JSON.parse(sessionStorage.getItem(PLACE) ?? 'null') as Name | null)
  const attach = async ({ document, path, origin }: Name) => {
    const name = { document, document_kind: 'robot' as const, path, origin }
    const found = await ask({ kind: 'attach', ...name, in_front: false })
    if (found === undefined && document === current) leaveEditor()
    return found
  }
  await Promise.all(Object.values(robots).map(({ state }) => attach(state)))
  return last ? attach(last) : undefined
}

/** All joint positions at zero, or at the limit nearest to zero. */
export function atRest({ links }: RobotContent): Joints {
  const moving = links.filter(({ moves }) => moves)
  const zero = moving.map(() => 0)
  const q = moving.map(({ cells }) => {
    const [low, high] = [cells['lowest'], cells['highest']]
    return typeof low === 'number' && typeof high === 'number' ? Math.min(Math.max(0, low), high) : 0
  })
  return { q, qd: zero, qdd: zero }
}

export function setJoints(change: Partial<Joints>): void {
  const { current, joints } = useDesk.getState()
  if (!current || !joints[current]) return
  useDesk.setState({ joints: { ...joints, [current]: { ...joints[current], ...change } } })
  readSoon()
}

/** Apply an edit; returns the refusal if there is one. Refusals are shown at the cell, not as notices. */
export async function edit(change: Edit, gesture = ''): Promise<Refusal | undefined> {
  const { current, robots } = useDesk.getState()
  const robot = current ? robots[current] : undefined
  if (!robot) return undefined
  try {
    await line.ask({ kind: 'change', ...alteration(robot.state), gesture, edit: change })
    return undefined
  } catch (error) {
    if (error instanceof Refusal) return error
    throw error
  }
}

let wanted = false
let under = false

/** Request the read-outs of the present configuration; of several pending requests only the last is sent. */
function readSoon(): void {
  wanted = true
  if (under) return
  under = true
  useDesk.setState({ reading: true })
  void readOn()
}

async function readOn(): Promise<void> {
  while (wanted) {
    wanted = false
    const { current, joints } = useDesk.getState()
    const now = current && joints[current]
    if (!now) break
    try {
      const readings = await line.ask({ kind: 'readings', document: current, ...now })
      if (useDesk.getState().current === current) useDesk.setState({ readings })
    } catch (error) {
      // The joints have changed meanwhile: another request follows. After an error nothing is shown.
      if (!(error instanceof Refusal)) throw error
      useDesk.setState({ readings: null })
    }
  }
  under = false
  useDesk.setState({ reading: false })
}

// -- display of numbers -------------------------------------------------------------------------------------

/** Whether a joint column contains an angle, for the type of the joint. */
export function isAngle(column: CellColumn, turns: boolean): boolean {
  return (
    column.quantity === 'angle' || (turns && (column.quantity === 'coordinate' || column.quantity === 'rate'))
  )
}

/** The displayed unit of a cell. */
export function unitOf(column: CellColumn, angles: Angles, turns?: boolean): string {
  if (column.quantity === 'angle') return angles === 'deg' ? '°' : 'rad'
  if (column.quantity === 'coordinate' || column.quantity === 'rate') {
    const per = column.quantity === 'rate' ? '/s' : ''
    const angle = (angles === 'deg' ? '°' : 'rad') + per
    return turns === undefined ? `${angle}, m${per}` : turns ? angle : `m${per}`
  }
  return column.unit
}

const PARTS = [1, 2, 3, 4, 6, 12]

/** An SI value as the text of its cell. */
export function cellText(value: number | string | null | undefined, angle: boolean, angles: Angles): string {
  if (value === null || value === undefined) return ''
  if (typeof value === 'string') return value
  if (!angle) return plain(value)
  if (angles === 'deg') return plain(Number(((value * 180) / Math.PI).toPrecision(12)))
  for (const part of PARTS) {
    const times: number = (value / Math.PI) * part
    if (
      times !== 0 &&
      Math.abs(times) <= 24 &&
      Math.abs(times - Math.round(times)) < 1e-12 &&
      value === (Math.round(times) * Math.PI) / part
    ) {
      const top = Math.abs(Math.round(times)) === 1 ? 'pi' : `${Math.abs(Math.round(times))}*pi`
      return `${times < 0 ? '-' : ''}${top}${part === 1 ? '' : `/${part}`}`
    }
  }
  return plain(value)
}

function plain(value: number): string {
  return String(Object.is(value, -0) ? 0 : value).replace('e+', 'e')
}

/** A read-out rounded to a readable number of digits. */
export function shortNumber(value: number, digits = 4): string {
  const size = Math.abs(value)
  if (size < 0.5 * 10 ** -digits) return (0).toFixed(Math.min(digits, 3))
  if (size >= 1e5) return value.toExponential(2)
  return value.toFixed(Math.max(0, Math.min(digits, digits - Math.floor(Math.log10(Math.max(size, 1))))))
}
