import type { ReactFlowInstance } from '@xyflow/react'
import { CLICK_PX, hasOwnMenu, useMenuHandlers } from '../context_menu_state'
import { useStudio } from '../store'
import { drawBranch } from './branching'
import { duplicateAt } from './clipboard'
import { clearCopies, useDraggedCopies } from './drag_preview'
import { GRID } from './insert'
import { followPointer } from './pointer_drag'
import type { SheetNode } from './sheet_graph'
import type { WireEdgeType } from './wire_edge'

type Flow = ReactFlowInstance<SheetNode, WireEdgeType>

/** The name of the block or note, or the key of the wire, at an element of the sheet. */
export const nodeNameAt = (element: Element): string | null =>
  element.closest('.react-flow__node')?.getAttribute('data-id') ?? null
export const wireKeyAt = (element: Element): string | null =>
  element.closest('.react-flow__edge')?.getAttribute('data-id') ?? null

/** The handlers of the right button: a click opens a menu; a drag duplicates blocks or draws a branch. */
export function useRightButton(
  flow: Flow,
  edges: readonly WireEdgeType[],
  selectWires: (keys: ReadonlySet<string>) => void,
) {
  return {
    onPointerDownCapture: rightDrag(flow, edges),
    ...useMenuHandlers(
      (at, element) =>
        void import('./sheet_menus').then(({ openSheetMenu }) =>
          openSheetMenu(at, element, (wire) => selectWires(new Set([wire]))),
        ),
    ),
  }
}

/** A drag with the right button: it duplicates blocks and notes, and draws branches of wires. */
function rightDrag(flow: Flow, edges: readonly WireEdgeType[]) {
  return (event: React.PointerEvent): void => {
    if (event.button !== 2 || hasOwnMenu(event.target)) return
    const target = event.target as Element
    if (target.closest('.react-flow__handle')) return
    const node = nodeNameAt(target)
    const edge = edges.find(({ id }) => id === wireKeyAt(target))
    if (node) duplicateWhileDragged(flow, node, event.nativeEvent)
    else if (edge?.data?.path.length)
      drawBranch(flow, `${edge.source}/${edge.sourceHandle}`, edge.data.path, event.nativeEvent)
  }
}

/** Duplicate a block, or all selected blocks, at the release of the pointer; Escape cancels. */
function duplicateWhileDragged(flow: Flow, node: string, pointerDown: PointerEvent): void {
  const { selection } = useStudio.getState()
  const names = selection.has(node) ? [...selection] : [node]
  const move = (event: PointerEvent) => {
    const [x, y] = [event.clientX - pointerDown.clientX, event.clientY - pointerDown.clientY]
    if (!useDraggedCopies.getState().names.length && Math.hypot(x, y) <= CLICK_PX) return
    const onGrid = (distance: number) => GRID * Math.round(distance / flow.getZoom() / GRID)
    useDraggedCopies.setState({ names, shift: [onGrid(x), onGrid(y)] })
  }
  const drop = () => {
    const copies = useDraggedCopies.getState()
    const [x, y] = copies.shift
    if (copies.names.length && (x || y)) void duplicateAt(copies.names, [x, y])
  }
  followPointer(pointerDown, { move, drop, finish: clearCopies })
}
