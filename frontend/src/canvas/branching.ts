import type { ReactFlowInstance } from '@xyflow/react'
import { create } from 'zustand'
import { nearestInput, nearestPointOn } from '../model/branching'
import type { Point } from '../model/wire_lines'
import { isFrame } from '../model/wires'
import type { Wire } from '../protocol'
import { change, useStudio } from '../store'
import { connectAt } from './connecting'
import { followPointer } from './pointer_drag'

type Flow = Pick<ReactFlowInstance, 'screenToFlowPosition' | 'getZoom'>

/** Distance from an input within which a new wire ends there, screen px. */
const SNAP_PX = 24
/** Movement from which a press on a wire is a drag, screen px. */
const DRAG_PX = 3

/** A wire that is being drawn from a point of another wire, or whose end is being moved. */
interface DrawnWire {
  /** The output at the start of the wire. */
  source: string
  from: Point
  /** The wire whose end is being moved. */
  instead?: Wire
}

interface Branch extends Pick<DrawnWire, 'source'> {
  from: Point
  to: Point
  /** The input at which the branch would end. */
  target: string | null
}

/** The branch that is being drawn. */
export const useBranch = create<{ branch: Branch | null }>(() => ({ branch: null }))

/**
 * Draw a branch from a point of a wire: to an input, to a block, or to the empty sheet, where the list of
 * blocks opens. Escape cancels it.
 */
export function drawBranch(
  flow: Flow,
  source: string,
  path: readonly Point[],
  pressed: PointerEvent | React.PointerEvent,
): void {
  drawWire(flow, { source, from: nearestPointOn(path, sheetPoint(flow, pressed)) }, pressed)
}

/** Move the end of a wire from its input to another input, to a block, or to the empty sheet. */
export function moveEnd(flow: Flow, wire: Wire, path: readonly Point[], pressed: PointerEvent): void {
  drawWire(flow, { source: wire.source, from: path[0]!, instead: wire }, pressed)
}

const sheetPoint = (flow: Flow, event: { clientX: number; clientY: number }): Point => {
  const { x, y } = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false })
  return [x, y]
}

function drawWire(
  flow: Flow,
  { source, from, instead }: DrawnWire,
  pressed: PointerEvent | React.PointerEvent,
): void {
  const move = (event: PointerEvent) => {
    const distance = Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY)
    if (!useBranch.getState().branch && distance <= DRAG_PX) return
    const pointer = sheetPoint(flow, event)
    const { blocks = {} } = useStudio.getState().document ?? {}
    const frame = isFrame(blocks, source)
    const input = nearestInput(Object.values(blocks), pointer, SNAP_PX / flow.getZoom(), frame)
    useBranch.setState({ branch: { source, from, to: input?.at ?? pointer, target: input?.port ?? null } })
  }
  const drop = (event: PointerEvent) => {
    const { branch } = useBranch.getState()
    if (!branch) return
    const removed = instead ? [instead] : []
    if (instead && branch.target === instead.target) return
    if (branch.target)
      void change({ kind: 'connect', wire: { source, target: branch.target }, instead: removed })
    else connectAt({ x: event.clientX, y: event.clientY }, source, true, removed)
  }
  followPointer(pressed, { move, drop, finish: () => useBranch.setState({ branch: null }) })
}
