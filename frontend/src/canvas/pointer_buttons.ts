import type { ReactFlowInstance } from '@xyflow/react'
import { CLICK_PX, hasOwnMenu, useMenuHandlers } from '../context_menu_state'
import { useStudio } from '../store'
import { drawBranch, moveEnd } from './branching'
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

/**
 * The handlers of the right button: a click opens a menu; a drag duplicates blocks or draws a branch. A drag
 * with the left button from a connected input moves the end of its wire. `notePress` is called at every
 * press.
 */
export function usePointerDrags(
  flow: Flow,
  edges: readonly WireEdgeType[],
  notePress: () => void,
  selectWires: (keys: ReadonlySet<string>) => void,
) {
  return {
    onPointerDownCapture: (event: React.PointerEvent) => {
      notePress()
      if (event.button === 0) dragEnd(flow, edges, event)
      else rightDrag(flow, edges, event)
    },
    ...useMenuHandlers(
      (at, element) =>
        void import('./sheet_menus').then(({ openSheetMenu }) =>
          openSheetMenu(at, element, (wire) => selectWires(new Set([wire]))),
        ),
    ),
  }
}

/** A drag with the right button: it duplicates blocks and notes, and draws branches of wires. */
function rightDrag(flow: Flow, edges: readonly WireEdgeType[], event: React.PointerEvent): void {
  if (event.button !== 2 || hasOwnMenu(event.target)) return
  const target = event.target as Element
  if (target.closest('.react-flow__handle')) return
  const node = nodeNameAt(target)
  const edge = edges.find(({ id }) => id === wireKeyAt(target))
  if (node) duplicateWhileDragged(flow, node, event.nativeEvent)
  else if (edge?.data?.path.length)
    drawBranch(flow, `${edge.source}/${edge.sourceHandle}`, edge.data.path, event.nativeEvent)
}

/** A drag from a connected input: it moves the end of the wire. From a frame port a further line is drawn. */
function dragEnd(flow: Flow, edges: readonly WireEdgeType[], event: React.PointerEvent): void {
  const target = event.target as Element
  const port = target.closest('.react-flow__handle.target')?.getAttribute('data-handleid')
  const node = nodeNameAt(target)
  if (!port || !node) return
  const edge = edges.find(({ target: block, targetHandle }) => block === node && targetHandle === port)
  if (!edge?.data?.path.length || edge.data.frame) return
  // React Flow would draw a wire from the input.
  event.preventDefault()
  if (document.activeElement instanceof HTMLInputElement) document.activeElement.blur()
  const wire = { source: `${edge.source}/${edge.sourceHandle}`, target: `${node}/${port}` }
  moveEnd(flow, wire, edge.data.path, event.nativeEvent)
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
