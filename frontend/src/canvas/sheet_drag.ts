import type { ReactFlowInstance, XYPosition } from '@xyflow/react'
import { useEffect, useRef, useState } from 'react'
import {
  isInsertable,
  alignedPosition,
  insertIntoWire,
  insertionAt,
  wireDifference,
  disconnectBlocks,
  wireAt,
} from '../model/rewiring'
import { wireKey, type Places } from '../model/wires'
import type { SheetBlock, SheetNote, Wire } from '../protocol'
import { useStudio } from '../store'
import type { Press } from './clicks'
import { duplicateAt } from './clipboard'
import { clearCopies } from './drag_preview'
import { alignment, useGuides } from './guides'
import { BLOCK_TYPE, insertBlock } from './insert'
import { onEscape } from './pointer_drag'
import { forgetPlaced, usePlaced } from './placed_block'
import { moveNodes } from './sheet_actions'
import type { SheetNode } from './sheet_graph'
import type { WireEdgeType } from './wire_edge'

/**
 * The effect of a drag on wires: names of disconnected blocks, and of an unconnected block that is inserted
 * into the wire on which it is dropped. `duplicated`: the blocks and notes that the drag duplicates.
 * `cancelled`: Escape was pressed; the blocks return to their positions.
 */
interface DragEffect {
  disconnected: readonly string[]
  insertable: string | null
  duplicated: readonly string[] | null
  cancelled: boolean
}

const NO_EFFECT: DragEffect = { disconnected: [], insertable: null, duplicated: null, cancelled: false }

/**
 * The state of a drag on a sheet: displaced blocks, blocks that change wires, and the wire into which a block
 * would be inserted.
 */
export function useSheetDrag(blocks: Record<string, SheetBlock>, notes: Record<string, SheetNote>) {
  const [drag, setDrag] = useState<Places>({})
  const [{ disconnected, insertable }, setEffect] = useState(NO_EFFECT)
  /** The effect of the drag, available before the next rendering. */
  const effect = useRef(NO_EFFECT)
  /** Removes the listener for Escape, which cancels the drag. */
  const escape = useRef(new AbortController())
  /** The wire into which a dragged block would be inserted. */
  const [targetWire, setTargetWire] = useState<string | null>(null)
  const synchronised = useStudio((s) => s.sent.length === 0)
  // When the server has applied the new positions, the displacements of the drag are discarded.
  useEffect(() => {
    if (synchronised) setDrag((now) => (Object.keys(now).length ? {} : now))
  }, [blocks, notes, synchronised])
  return { drag, setDrag, disconnected, insertable, effect, escape, setEffect, targetWire, setTargetWire }
}

type PointerEvents = MouseEvent | TouchEvent | React.MouseEvent
export type SheetDrag = ReturnType<typeof useSheetDrag>
/** The state of a drag, and the selection when the pointer was pressed. */
type PressedDrag = SheetDrag & { press: { readonly current: Press } }

/** The start of a drag: its effect on wires depends on the pressed keys; Escape cancels the drag. */
function startDrag(
  { effect, escape, setEffect, setTargetWire, setDrag, press }: PressedDrag,
  { ctrlKey, metaKey, shiftKey, altKey }: PointerEvents,
  pressed: SheetNode,
  nodes: SheetNode[],
  dragged: SheetBlock[],
  wires: Wire[],
): void {
  escape.current.abort()
  escape.current = new AbortController()
  onEscape(() => {
    setEffect((effect.current = { ...NO_EFFECT, cancelled: true }))
    setDrag({})
    setTargetWire(null)
    useGuides.setState({ guides: [] })
    clearCopies()
    forgetPlaced()
  }, escape.current.signal)
  if (ctrlKey || metaKey) {
    // With Ctrl, React Flow has added the pressed block to the selection.
    const duplicated = press.current.nodes.has(pressed.id) ? nodes.map(({ id }) => id) : [pressed.id]
    setEffect((effect.current = { ...NO_EFFECT, duplicated }))
    return
  }
  const disconnected = shiftKey || altKey ? dragged.map(({ name }) => name) : []
  const [first] = dragged
  const canInsert =
    dragged.length === 1 &&
    first &&
    isInsertable(first, disconnected.length ? disconnectBlocks(dragged, wires) : wires)
  if (disconnected.length || canInsert)
    setEffect((effect.current = { ...NO_EFFECT, disconnected, insertable: canInsert ? first.name : null }))
}

/** The handlers of a drag of blocks on the sheet. */
export function dragHandlers(
  sheetDrag: PressedDrag,
  blocks: Record<string, SheetBlock>,
  notes: Record<string, SheetNote>,
  wires: Wire[],
  edges: WireEdgeType[],
  zoom: () => number,
) {
  const { effect, escape, setEffect, setTargetWire, setDrag } = sheetDrag
  /** Align the dragged blocks, unless Alt is pressed or the drag duplicates them. */
  const aligned = (event: PointerEvents, nodes: SheetNode[]) =>
    event.altKey || effect.current.duplicated ? NOT_ALIGNED : alignment(nodes, blocks, zoom())
  const whileDragging = (event: PointerEvents, node: SheetNode, nodes: SheetNode[]) => {
    if (effect.current.cancelled) return
    const { dx, dy, guides } = aligned(event, nodes)
    useGuides.setState({ guides })
    if (dx || dy) setDrag((now) => ({ ...now, ...shifted(nodes, dx, dy) }))
    const block = node.id === effect.current.insertable ? blocks[node.id] : undefined
    const segment = block && segmentBelow(block, node.position, edges, wires)
    if (block) setTargetWire(keyOrNull(segment?.wire))
    showPlaced(nodes, segment !== undefined, effect.current, [dx, dy])
  }
  const endDrag = (event: PointerEvents, node: SheetNode, moved: SheetNode[]) => {
    escape.current.abort()
    if (effect.current.cancelled) {
      setEffect((effect.current = NO_EFFECT))
      return
    }
    const { dx, dy } = aligned(event, moved)
    useGuides.setState({ guides: [] })
    usePlaced.setState({ at: undefined })
    const positions = shifted(moved, dx, dy)
    const { disconnected, insertable, duplicated } = effect.current
    effect.current = NO_EFFECT
    if (duplicated) {
      setEffect(NO_EFFECT)
      setDrag({})
      const original = blocks[node.id]?.place ?? notes[node.id]
      const offset =
        original && ([node.position.x - original.x, node.position.y - original.y] as [number, number])
      clearCopies()
      if (offset && (offset[0] || offset[1])) void duplicateAt(duplicated, offset)
      return
    }
    const remainingWires = disconnected.length
      ? disconnectBlocks(blocksByName(blocks, disconnected), wires)
      : wires
    const block = insertable === null ? undefined : blocks[insertable]
    const target = block && segmentBelow(block, node.position, edges, wires)
    if (target) positions[block.name] = alignedPosition(block, node.position, target)
    const wiresAfter = target ? insertIntoWire(block, target, remainingWires) : remainingWires
    // The wires remain as drawn until the server has applied the edit.
    void moveNodes(
      positions,
      disconnected.length || target ? wireDifference(wires, wiresAfter) : undefined,
    ).finally(() => setEffect((now) => (now === effect.current ? now : NO_EFFECT)))
    setTargetWire(null)
  }
  return {
    onNodeDragStart: (event: PointerEvents, node: SheetNode, nodes: SheetNode[]): void => {
      const dragged = blocksByName(
        blocks,
        nodes.map(({ id }) => id),
      )
      startDrag(sheetDrag, event, node, nodes, dragged, wires)
    },
    onNodeDrag: whileDragging,
    onNodeDragStop: endDrag,
  }
}

const NOT_ALIGNED = { dx: 0, dy: 0, guides: [] }

/** Propose a wire for a single dragged block, unless the drag has another effect on wires. */
function showPlaced(
  nodes: SheetNode[],
  isInserted: boolean,
  { duplicated, disconnected }: DragEffect,
  [dx, dy]: [number, number],
): void {
  const [node] = nodes
  const isPlaced = node && nodes.length === 1 && !isInserted && !duplicated && !disconnected.length
  if (isPlaced)
    usePlaced.setState({ name: node.id, at: { x: node.position.x + dx, y: node.position.y + dy } })
  else forgetPlaced()
}

/** The positions of dragged blocks and notes after a displacement. */
const shifted = (nodes: SheetNode[], dx: number, dy: number): Places =>
  Object.fromEntries(nodes.map(({ id, position }) => [id, { x: position.x + dx, y: position.y + dy }]))

/** The handlers of a drag of a block type from the library to the sheet. */
export function dropHandlers(
  setTargetWire: SheetDrag['setTargetWire'],
  flow: ReactFlowInstance<SheetNode, WireEdgeType>,
  wires: Wire[],
  edges: WireEdgeType[],
) {
  const drop = (event: React.DragEvent) => {
    const type = event.dataTransfer.getData(BLOCK_TYPE)
    if (!type) return
    event.preventDefault()
    // The next keys, such as undo, belong to the sheet, not to the search field of the library.
    if (document.activeElement instanceof HTMLInputElement) document.activeElement.blur()
    const point = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false })
    const segment = wireAt(point, edges, wires)
    setTargetWire(null)
    if (segment)
      void insertBlock(type, { x: point.x, y: segment.y }, { wire: segment.wire, wireY: segment.y })
    else void insertBlock(type, point)
  }
  const hover = (event: React.DragEvent) => {
    event.preventDefault()
    if (!event.dataTransfer.types.includes(BLOCK_TYPE)) return
    setTargetWire(
      keyOrNull(
        wireAt(
          flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false }),
          edges,
          wires,
        )?.wire,
      ),
    )
  }
  return { onDragOver: hover, onDragLeave: () => setTargetWire(null), onDrop: drop }
}

/** The segment of a wire into which a block at a position would be inserted. */
const segmentBelow = (block: SheetBlock, at: XYPosition, edges: WireEdgeType[], wires: Wire[]) =>
  insertionAt(block, centreOf(block, at), edges, wires)

const keyOrNull = (wire: Wire | undefined): string | null => (wire ? wireKey(wire) : null)

export const blocksByName = (blocks: Record<string, SheetBlock>, names: readonly string[]): SheetBlock[] =>
  names.map((name) => blocks[name]).filter((block) => block !== undefined)

const centreOf = ({ width, height }: SheetBlock, at: { x: number; y: number }) => ({
  x: at.x + width / 2,
  y: at.y + height / 2,
})
