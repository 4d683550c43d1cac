import type { ReactFlowInstance } from '@xyflow/react'
import { useEffect, useRef, useState } from 'react'
import { isLoose, levelled, putInto, rewired, takenOut, wireAt } from '../model/rewiring'
import { wireKey, type Places } from '../model/wires'
import type { SheetBlock, SheetNote, Wire } from '../protocol'
import { useStudio } from '../store'
import { duplicateAt } from './clipboard'
import { noCopies } from './copying'
import { alignment, useGuides } from './guides'
import { BLOCK_TYPE, insertBlock } from './insert'
import { move } from './sheet_actions'
import type { SheetNode } from './sheet_graph'
import type { WireEdgeType } from './wire_edge'

/**
 * The dragged blocks that change wires: blocks that are disconnected, and an unconnected block that is
 * inserted into the wire on which it is dropped. `copies`: the drag duplicates the blocks.
 */
const NOTHING_HELD: { freed: readonly string[]; loose: string | null; copies: boolean } = {
  freed: [],
  loose: null,
  copies: false,
}

/**
 * The state of a drag on a sheet: displaced blocks, blocks that change wires, and the wire into which a block
 * would be inserted.
 */
export function useSheetDrag(blocks: Record<string, SheetBlock>, notes: Record<string, SheetNote>) {
  const [drag, setDrag] = useState<Places>({})
  const [{ freed, loose }, setHeld] = useState(NOTHING_HELD)
  /** The blocks that change wires, available before the next rendering. */
  const held = useRef(NOTHING_HELD)
  /** The wire into which a dragged block would be inserted. */
  const [into, setInto] = useState<string | null>(null)
  const settled = useStudio((s) => s.sent.length === 0)
  // When the server has applied the new positions, the displacements of the drag are discarded.
  useEffect(() => {
    if (settled) setDrag((now) => (Object.keys(now).length ? {} : now))
  }, [blocks, notes, settled])
  return { drag, setDrag, freed, loose, held, setHeld, into, setInto }
}

export type SheetDrag = ReturnType<typeof useSheetDrag>

/** The handlers of a drag of blocks on the sheet. */
export function dragHandlers(
  { held, setHeld, setInto, setDrag }: SheetDrag,
  blocks: Record<string, SheetBlock>,
  notes: Record<string, SheetNote>,
  wires: Wire[],
  edges: WireEdgeType[],
  zoom: () => number,
) {
  const takeHold = (event: MouseEvent | TouchEvent | React.MouseEvent, _: SheetNode, nodes: SheetNode[]) => {
    const taken = present(
      blocks,
      nodes.map(({ id }) => id),
    )
    if (event.ctrlKey || event.metaKey) {
      setHeld((held.current = { ...NOTHING_HELD, copies: true }))
      return
    }
    const freed = event.shiftKey || event.altKey ? taken.map(({ name }) => name) : []
    const [one] = taken
    const alone = taken.length === 1 && one && isLoose(one, freed.length ? takenOut(taken, wires) : wires)
    if (freed.length || alone)
      setHeld((held.current = { freed, loose: alone ? one.name : null, copies: false }))
  }
  /** Align the dragged blocks, unless Alt is pressed or the drag duplicates them. */
  const aligned = (event: MouseEvent | TouchEvent | React.MouseEvent, nodes: SheetNode[]) =>
    event.altKey || held.current.copies ? NOT_ALIGNED : alignment(nodes, blocks, zoom())
  const carry = (event: MouseEvent | TouchEvent | React.MouseEvent, node: SheetNode, nodes: SheetNode[]) => {
    const { dx, dy, guides } = aligned(event, nodes)
    useGuides.setState({ guides })
    if (dx || dy) setDrag((now) => ({ ...now, ...shifted(nodes, dx, dy) }))
    const block = node.id === held.current.loose ? blocks[node.id] : undefined
    if (block) setInto(keyOf(wireAt(middleOf(block, node.position), edges, wires)?.wire))
  }
  const letGo = (event: MouseEvent | TouchEvent | React.MouseEvent, node: SheetNode, moved: SheetNode[]) => {
    const { dx, dy } = aligned(event, moved)
    useGuides.setState({ guides: [] })
    const to = shifted(moved, dx, dy)
    const { freed, loose, copies } = held.current
    held.current = NOTHING_HELD
    if (copies) {
      setHeld(NOTHING_HELD)
      setDrag({})
      const from = blocks[node.id]?.place ?? notes[node.id]
      const shift = from && ([node.position.x - from.x, node.position.y - from.y] as [number, number])
      const chosen = moved.map(({ id }) => id)
      noCopies()
      if (shift && (shift[0] || shift[1])) void duplicateAt(chosen, shift)
      return
    }
    const left = freed.length ? takenOut(present(blocks, freed), wires) : wires
    const block = loose === null ? undefined : blocks[loose]
    const found = block && wireAt(middleOf(block, node.position), edges, wires)
    if (found) to[block.name] = levelled(block, node.position, found)
    const after = found ? putInto(block, found.wire, left) : left
    // The wires remain as drawn until the server has applied the edit.
    void move(to, freed.length || found ? rewired(wires, after) : undefined).finally(() =>
      setHeld((now) => (now === held.current ? now : NOTHING_HELD)),
    )
    setInto(null)
  }
  return { onNodeDragStart: takeHold, onNodeDrag: carry, onNodeDragStop: letGo }
}

const NOT_ALIGNED = { dx: 0, dy: 0, guides: [] }

/** The positions of dragged blocks and notes after a displacement. */
const shifted = (nodes: SheetNode[], dx: number, dy: number): Places =>
  Object.fromEntries(nodes.map(({ id, position }) => [id, { x: position.x + dx, y: position.y + dy }]))

/** The handlers of a drag of a block type from the library to the sheet. */
export function dropHandlers(
  setInto: SheetDrag['setInto'],
  flow: ReactFlowInstance<SheetNode, WireEdgeType>,
  wires: Wire[],
  edges: WireEdgeType[],
) {
  const drop = (event: React.DragEvent) => {
    const type = event.dataTransfer.getData(BLOCK_TYPE)
    if (!type) return
    event.preventDefault()
    const at = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false })
    const found = wireAt(at, edges, wires)
    setInto(null)
    if (found) void insertBlock(type, { x: at.x, y: found.y }, { wire: found.wire, level: found.y })
    else void insertBlock(type, at)
  }
  const hover = (event: React.DragEvent) => {
    event.preventDefault()
    if (!event.dataTransfer.types.includes(BLOCK_TYPE)) return
    setInto(
      keyOf(
        wireAt(
          flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false }),
          edges,
          wires,
        )?.wire,
      ),
    )
  }
  return { onDragOver: hover, onDragLeave: () => setInto(null), onDrop: drop }
}

const keyOf = (wire: Wire | undefined): string | null => (wire ? wireKey(wire) : null)

export const present = (blocks: Record<string, SheetBlock>, names: readonly string[]): SheetBlock[] =>
  names.map((name) => blocks[name]).filter((block) => block !== undefined)

const middleOf = ({ width, height }: SheetBlock, at: { x: number; y: number }) => ({
  x: at.x + width / 2,
  y: at.y + height / 2,
})
