import type { ReactFlowInstance } from '@xyflow/react'
import { create } from 'zustand'
import { nearestInput, nearestPointOn } from '../model/branching'
import type { Point } from '../model/wire_lines'
import { isFrame } from '../model/wires'
import { change, useStudio } from '../store'
import { connectAt } from './connecting'
import { followPointer } from './pointer_drag'

/** Distance from an input within which a new wire ends there, screen px. */
const SNAP_PX = 24
/** Movement from which a press on a wire is a drag, screen px. */
const DRAG_PX = 3

interface Branch {
  /** The output at the start of the branch. */
  source: string
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
  flow: Pick<ReactFlowInstance, 'screenToFlowPosition' | 'getZoom'>,
  source: string,
  path: readonly Point[],
  pressed: PointerEvent | React.PointerEvent,
): void {
  const sheetPoint = (event: { clientX: number; clientY: number }): Point => {
    const { x, y } = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false })
    return [x, y]
  }
  const from = nearestPointOn(path, sheetPoint(pressed))
  const move = (event: PointerEvent) => {
    const distance = Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY)
    if (!useBranch.getState().branch && distance <= DRAG_PX) return
    const pointer = sheetPoint(event)
    const { blocks = {} } = useStudio.getState().document ?? {}
    const frame = isFrame(blocks, source)
    const input = nearestInput(Object.values(blocks), pointer, SNAP_PX / flow.getZoom(), frame)
    useBranch.setState({ branch: { source, from, to: input?.at ?? pointer, target: input?.port ?? null } })
  }
  const drop = (event: PointerEvent) => {
    const { branch } = useBranch.getState()
    if (!branch) return
    if (branch.target) void change({ kind: 'connect', wire: { source, target: branch.target } })
    else connectAt({ x: event.clientX, y: event.clientY }, source, true)
  }
  followPointer(pressed, { move, drop, finish: () => useBranch.setState({ branch: null }) })
}
