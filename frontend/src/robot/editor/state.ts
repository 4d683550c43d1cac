import { create } from 'zustand'
import { Refusal } from '../../connection'
import type { ChangeOf, ContentOf, Edit, EventOf } from '../../messages'
import type { CellColumn, DocumentState, Readings, RobotContent, RobotTables } from '../../protocol'
import { alteration, ask, connection } from '../../store'
import { storedData } from '../../stored_data'

/** A robot that this client shows or has shown, in the last state sent by the server. */
export interface OpenRobot extends RobotContent {
  state: DocumentState
}
export type Angles = 'deg' | 'rad'

/** Displayed joint positions, speeds and accelerations: rad or m, per second, per second². */
export interface Joints {
  q: number[]
  qd: number[]
  qdd: number[]
}

interface RobotEditorState {
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

/** The open robots, and the robot in the editor. */
export const useRobotEditor = create<RobotEditorState>(() => ({
  robots: {},
  current: null,
  tables: null,
  joints: {},
  readings: null,
  reading: false,
  angles: 'deg',
  notes: [],
}))

function storeRobot(state: DocumentState, content: RobotContent): void {
  const { robots, joints } = useRobotEditor.getState()
  const robot = { ...content, state }
  const before = joints[state.document]
  const isCompatible =
    before && before.q.length === content.coordinates.length && before.qd.length === content.speeds.length
  useRobotEditor.setState({
    robots: { ...robots, [state.document]: robot },
    joints: isCompatible ? joints : { ...joints, [state.document]: atRest(content) },
  })
  if (useRobotEditor.getState().current === state.document) requestReadings()
}

/** Add a robot that this client shows from now on. */
export function robotOpened(event: EventOf<'opened'>, content: ContentOf<'robot'>): void {
  storeRobot(event.state, content)
  if (event.in_front) showRobot(event.state.document, event.notes)
}

/** Update a robot that has changed. */
export function robotChanged({ state }: EventOf<'changed'>, change: ChangeOf<'robot'>): void {
  storeRobot(state, change.content)
}

/** Display a robot that this client has loaded. */
export function showRobot(robot: string, notes: string[] = []): void {
  useRobotEditor.setState({ current: robot, notes, readings: null })
  if (!useRobotEditor.getState().tables)
    void ask({ kind: 'robot_tables' }).then((tables) => tables && useRobotEditor.setState({ tables }))
  requestReadings()
}

/** Return to the diagram. */
export function leaveEditor(): void {
  useRobotEditor.setState({ current: null, notes: [] })
}

/** Remove a robot that was closed. */
export function forgetRobot(robot: string): void {
  const { [robot]: closed, ...robots } = useRobotEditor.getState().robots
  if (closed) useRobotEditor.setState({ robots })
}

const STORAGE_KEY = 'armblocks-robot'
type AttachedRobot = Pick<DocumentState, 'document' | 'path' | 'origin'>

/** Store which robot this tab shows, so that a reload shows it again. */
useRobotEditor.subscribe(({ robots, current }, before) => {
  if (robots === before.robots && current === before.current) return
  const shown = current ? robots[current] : undefined
  if (!shown) return sessionStorage.removeItem(STORAGE_KEY)
  const { document, path, origin } = shown.state
  sessionStorage.setItem(STORAGE_KEY, JSON.stringify({ document, path, origin }))
})

/**
 * After a reconnection or a reload, let the server reopen the robots of this client under the same keys.
 * Returns the key of the robot that the tab showed before a reload.
 */
export async function reattachRobots(): Promise<string | undefined> {
  const { robots, current } = useRobotEditor.getState()
  const last = current ? null : storedData<AttachedRobot>(sessionStorage, STORAGE_KEY)
  const attach = async ({ document, path, origin }: AttachedRobot) => {
    const name = { document, document_kind: 'robot' as const, path, origin }
    const key = await ask({ kind: 'attach', ...name, in_front: false })
    if (key === undefined && document === current) leaveEditor()
    return key
  }
  await Promise.all(Object.values(robots).map(({ state }) => attach(state)))
  return last ? attach(last) : undefined
}

/** All joint positions at rest: zero, or the limit nearest to zero. */
export function atRest({ coordinates, speeds }: RobotContent): Joints {
  const zero = speeds.map(() => 0)
  return { q: coordinates.map(({ rest }) => rest), qd: zero, qdd: zero }
}

const knownPoses = new WeakMap<number[], number[][][]>()

/** The poses of base, links and tool at these coordinates, if the server has sent them together. */
export function posesOf(q: number[]): number[][][] | undefined {
  return knownPoses.get(q)
}

/** Show joint coordinates whose poses are known, so that they are not requested again. */
export function setJointsWithPoses(change: Partial<Joints> & { q: number[] }, poses: number[][][]): void {
  knownPoses.set(change.q, poses)
  setJoints(change)
}

export function setJoints(change: Partial<Joints>): void {
  const { current, joints } = useRobotEditor.getState()
  if (!current || !joints[current]) return
  useRobotEditor.setState({ joints: { ...joints, [current]: { ...joints[current], ...change } } })
  requestReadings()
}

/** Apply an edit; returns the refusal if there is one. Refusals are shown at the cell, not as notices. */
export async function edit(change: Edit, gesture = ''): Promise<Refusal | undefined> {
  const { current, robots } = useRobotEditor.getState()
  const robot = current ? robots[current] : undefined
  if (!robot) return undefined
  try {
    await connection.ask({ kind: 'change', ...alteration(robot.state), gesture, edit: change })
    return undefined
  } catch (error) {
    if (error instanceof Refusal) return error
    throw error
  }
}

let outdated = false
let busy = false

/** Request the read-outs of the present configuration; of several pending requests only the last is sent. */
function requestReadings(): void {
  outdated = true
  if (busy) return
  busy = true
  useRobotEditor.setState({ reading: true })
  void updateReadings()
}

async function updateReadings(): Promise<void> {
  while (outdated) {
    outdated = false
    const { current, joints } = useRobotEditor.getState()
    const configuration = current && joints[current]
    if (!configuration) break
    try {
      const readings = await connection.ask({ kind: 'readings', document: current, ...configuration })
      if (useRobotEditor.getState().current === current) useRobotEditor.setState({ readings })
    } catch (error) {
      // The joints have changed meanwhile: another request follows. After an error nothing is shown.
      if (!(error instanceof Refusal)) throw error
      useRobotEditor.setState({ readings: null })
    }
  }
  busy = false
  useRobotEditor.setState({ reading: false })
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

const DENOMINATORS = [1, 2, 3, 4, 6, 12]

/** An SI value as the text of its cell. */
export function cellText(value: number | string | null | undefined, angle: boolean, angles: Angles): string {
  if (value === null || value === undefined) return ''
  if (typeof value === 'string') return value
  if (!angle) return numberText(value)
  if (angles === 'deg') return numberText(Number(((value * 180) / Math.PI).toPrecision(12)))
  for (const denominator of DENOMINATORS) {
    const numerator: number = (value / Math.PI) * denominator
    if (
      numerator !== 0 &&
      Math.abs(numerator) <= 24 &&
      Math.abs(numerator - Math.round(numerator)) < 1e-12 &&
      value === (Math.round(numerator) * Math.PI) / denominator
    ) {
      const numeratorText =
        Math.abs(Math.round(numerator)) === 1 ? 'pi' : `${Math.abs(Math.round(numerator))}*pi`
      return `${numerator < 0 ? '-' : ''}${numeratorText}${denominator === 1 ? '' : `/${denominator}`}`
    }
  }
  return numberText(value)
}

function numberText(value: number): string {
  return String(Object.is(value, -0) ? 0 : value).replace('e+', 'e')
}

/** A read-out rounded to a readable number of digits. */
export function shortNumber(value: number, digits = 4): string {
  const magnitude = Math.abs(value)
  if (magnitude < 0.5 * 10 ** -digits) return (0).toFixed(digits)
  if (magnitude >= 1e5) return value.toExponential(2)
  return value.toFixed(Math.max(0, Math.min(digits, digits - Math.floor(Math.log10(Math.max(magnitude, 1))))))
}
