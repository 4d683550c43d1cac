import type { ReactFlowInstance } from '@xyflow/react'
import { CLICK_PX, hasOwnMenu, useMenuHandlers } from '../context_menu_state'
import { useStudio } from '../store'
import { drawBranch } from './branching'
import { duplicateAt } from './clipboard'
import { noCopies, useCopies } from './copying'
import { GRID } from './insert'
import { followPointer } from './pointer_drag'
import type { SheetNode } from './sheet_graph'
import type { WireEdgeType } from './wire_edge'

type Flow = ReactFlowInstance<SheetNode, WireEdgeType>

/** The name of the block or note, or the key of the wire, at an element of the sheet. */
export const nodeAt = (element: Element): string | null =>
  element.closest('.react-flow__node')?.getAttribute('data-id') ?? null
export const wireAtElement = (element: Element): string | null =>
  element.closest('.react-flow__edge')?.getAttribute('data-id') ?? null

/** The handlers of the right button: a click opens a menu; a drag duplicates blocks or draws a branch. */
export function useRightButton(
  flow: Flow,
  edges: readonly WireEdgeType[],
  chooseWires: (keys: ReadonlySet<string>) => void,
) {
  return {
    onPointerDownCapture: rightDrag(flow, edges),
    ...useMenuHandlers(
      (at, element) =>
        void import('./sheet_menus').then(({ openSheetMenu }) =>
          openSheetMenu(at, element, (wire) => chooseWires(new Set([wire]))),
        ),
    ),
  }
}

/** A drag with the right button: it duplicates blocks and notes, and branches from a line. */
function rightDrag(flow: Flow, edges: readonly WireEdgeType[]) {
  return (event: React.PointerEvent): void => {
    if (event.button !== 2 || hasOwnMenu(event.target)) return
    const target = event.target as Element
    if (target.closest('.react-flow__handle')) return
    const node = nodeAt(target)
    const edge = edges.find(({ id }) => id === wireAtElement(target))
    if (node) duplicateWhileDragged(flow, node, event.nativeEvent)
    else if (edge?.data?.path.length)
      drawBranch(flow, `${edge.source}/${edge.sourceHandle}`, edge.data.path, event.nativeEvent)
  }
}

/** Duplicate a block, or all selected ones, at the release of the pointer; Escape cancels. */
function duplicateWhileDragged(flow: Flow, node: string, pressed: PointerEvent): void {
  const { selection } = useStudio.getState()
  const names = selection.has(node) ? [...selection] : [node]
  const move = (event: PointerEvent) => {
    const [x, y] = [event.clientX - pressed.clientX, event.clientY - pressed.clientY]
    if (!useCopies.getState().names.length && Math.hypot(x, y) <= CLICK_PX) return
    const onGrid = (distance: number) => GRID * Math.round(distance / flow.getZoom() / GRID)
    useCopies.setState({ names, shift: [onGrid(x), onGrid(y)] })
  }
  const drop = () => {
    const copies = useCopies.getState()
    const [x, y] = copies.shift
    if (copies.names.length && (x || y)) void duplicateAt(copies.names, [x, y])
  }
  followPointer(pressed, { move, drop, leave: noCopies })
}
