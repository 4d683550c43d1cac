import { useRef } from 'react'
import { useStudio } from '../store'
import type { SheetNode } from './sheet_graph'
import type { WireEdgeType } from './wire_edge'

/** The selection when the pointer was pressed: React Flow changes it before a drag or a click. */
export interface Press {
  nodes: ReadonlySet<string>
  wires: ReadonlySet<string>
}

/** The handlers of clicks on blocks, notes and wires, and the selection at the last press of the pointer. */
export function useClicks(
  selectedWires: ReadonlySet<string>,
  selectWires: (keys: ReadonlySet<string>) => void,
) {
  const press = useRef<Press>({ nodes: new Set(), wires: new Set() })
  const notePress = () => {
    press.current = { nodes: useStudio.getState().selection, wires: selectedWires }
  }
  const extend = (node: string | null, wire: string | null) => {
    useStudio.getState().select(node === null ? press.current.nodes : toggled(press.current.nodes, node))
    selectWires(wire === null ? press.current.wires : toggled(press.current.wires, wire))
  }
  const onNodeClick = (event: React.MouseEvent, { id }: SheetNode) => {
    const { nodes } = press.current
    if (event.shiftKey) extend(id, null)
    else if (event.ctrlKey || event.metaKey)
      void import('./selected_connections').then(({ connectSelected }) => connectSelected(id, nodes))
    else if (useStudio.getState().selection.size > 1) {
      useStudio.getState().select([id])
      selectWires(new Set())
    }
  }
  const onEdgeClick = ({ shiftKey }: React.MouseEvent, { id }: WireEdgeType) => {
    if (shiftKey) extend(null, id)
  }
  return { press, notePress, onNodeClick, onEdgeClick }
}

/** A set with one more, or without one, of its elements. */
function toggled(before: ReadonlySet<string>, element: string): ReadonlySet<string> {
  const after = new Set(before)
  if (!after.delete(element)) after.add(element)
  return after
}
