import { create } from 'zustand'
import { Refusal } from '../../connection'
import type { ChangeOf, ContentOf, Edit, EventOf } from '../../messages'
import type { CellColumn, DocumentState, Readings, RobotContent, RobotTables } from '../../protocol'
import { alteration, ask, line } from '../../store'

/** A robot that this page shows or has shown, as the server says it is now. */
export interface OpenRobot extends RobotContent {
  state: DocumentState
}
export type Angles = 'deg' | 'rad'

/** Positions, speeds and accelerations of the joints on the page: rad, m and per second. */
export interface Joints {
  q: number[]
  qd: number[]
  qdd: number[]
}

interface Desk {
  /** By the keys of their documents. */
  robots: Record<string, OpenRobot>
  /** The robot in the editor; null while the diagram is on the screen. */
  current: string | null
  tables: RobotTables | null
  joints: Record<string, Joints>
  readings: Readings | null
  /** The latest readings are of another form or configuration than the one on the screen. */
  reading: boolean
  angles: Angles
  /** What was said when the file was read that was opened last. */
  notes: string[]
}

/** The robots that are open, and the one in the editor. */
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

/** The page shows a robot from now on. */
export function robotOpened(event: EventOf<'opened'>, content: ContentOf<'robot'>): void {
  put(event.state, content)
  if (event.in_front) toFront(event.state.document, event.notes)
}

/** A robot has changed. */
export function robotChanged({ state }: EventOf<'changed'>, change: ChangeOf<'robot'>): void {
  put(state, change.content)
}

/** Bring a robot that this page knows to the screen. */
export function toFront(robot: string, notes: string[] = []): void {
  useDesk.setState({ current: robot, notes, readings: null })
  if (!useDesk.getState().tables)
    void ask({ kind: 'robot_tables' }).then((tables) => tables && useDesk.setState({ tables }))
  readSoon()
}

/** Back to the diagram. */
export function leaveEditor(): void {
  useDesk.setState({ current: null, notes: [] })
}

/** Put a robot away that needs no saving. */
export async function closeRobot(robot: string): Promise<void> {
  if ((await ask({ kind: 'close', document: robot })) === undefined) return
  const { [robot]: _, ...robots } = useDesk.getState().robots
  useDesk.setState({ robots })
}

const PLACE = 'armblocks-robot'
type Name = Pick<DocumentState, 'document' | 'path' | 'origin'>

/** Note which robot this tab shows: by it the same comes back after a reload. */
useDesk.subscribe(({ robots, current }, before) => {
  if (robots === before.robots && current === before.current) return
  const shown = current ? robots[current] : undefined
  if (!shown) return sessionStorage.removeItem(PLACE)
  const { document, path, origin } = shown.state
  sessionStorage.setItem(PLACE, JSON.stringify({ document, path, origin }))
})

/**
 * After the line was broken, or a reload: the server opens again what this page has open, under the same
 * keys. Gives the key of what the tab showed before it was loaded anew.
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

/** All joints at zero, or as near to it as their ranges allow. */
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

/** Carry out an edit; the refusal where there was one. Refusals belong to the cell, not to the notices. */
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

/** Read the arm as it stands now; of requests that come while one is answered, only the last counts. */
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
      // A joint came or went meanwhile: the next form asks again. What cannot be read shows nothing.
      if (!(error instanceof Refusal)) throw error
      useDesk.setState({ readings: null })
    }
  }
  under = false
  useDesk.setState({ reading: false })
}

// -- numbers as people read them ----------------------------------------------------------------------------

/** Whether a column of a joint that turns or slides holds an angle. */
export function isAngle(column: CellColumn, turns: boolean): boolean {
  return (
    column.quantity === 'angle' || (turns && (column.quantity === 'coordinate' || column.quantity === 'rate'))
  )
}

/** The unit of a cell as it is shown. */
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

/** A reading with as many digits as an eye can use. */
export function shortNumber(value: number, digits = 4): string {
  const size = Math.abs(value)
  if (size < 0.5 * 10 ** -digits) return (0).toFixed(Math.min(digits, 3))
  if (size >= 1e5) return value.toExponential(2)
  return value.toFixed(Math.max(0, Math.min(digits, digits - Math.floor(Math.log10(Math.max(size, 1))))))
}
