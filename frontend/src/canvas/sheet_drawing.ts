import { useMemo, useState } from 'react'
import { disconnectBlocks } from '../model/rewiring'
import { wireKey, type Places } from '../model/wires'
import type { Finding } from '../protocol'
import { useStudio } from '../store'
import { blocksByName, type SheetDrag } from './sheet_drag'
import { SheetGraph } from './sheet_graph'
import { useLiveLines } from './live_lines'
import { useBending } from './wire_edge'

/** The nodes and edges of the visible sheet, including the present drag. */
export function useSheetDrawing(
  { drag, disconnected, insertable, targetWire }: SheetDrag,
  selectedWires: ReadonlySet<string>,
) {
  const blocks = useStudio((s) => s.document!.blocks)
  const wires = useStudio((s) => s.document!.wires)
  const notes = useStudio((s) => s.document!.notes)
  const checkFindings = useStudio((s) => s.document!.findings)
  const strict = useStudio((s) => s.strict)
  const findings = useMemo(
    () =>
      strict ? checkFindings.map((finding): Finding => ({ ...finding, severity: 'error' })) : checkFindings,
    [checkFindings, strict],
  )
  const kinds = useStudio((s) => s.document!.wireKinds)
  const pathPrefix = useStudio((s) => s.document!.inside.map((name) => `${name}/`).join(''))
  const selection = useStudio((s) => s.selection)
  const sent = useStudio((s) => s.sent)
  const bending = useBending((s) => s.wire)
  const [graph] = useState(() => new SheetGraph())
  const drawnWires = useMemo(() => {
    if (bending) return wires.map((wire) => (wireKey(wire) === wireKey(bending) ? bending : wire))
    return disconnected.length ? disconnectBlocks(blocksByName(blocks, disconnected), wires) : wires
  }, [wires, bending, disconnected, blocks])
  const dragged = useMemo(
    () =>
      drawnWires === wires && insertable === null && !Object.keys(drag).length
        ? null
        : { places: drag, wires: drawnWires === wires ? null : drawnWires, passed: insertable },
    [drag, drawnWires, wires, insertable],
  )
  const { lines, overdue } = useLiveLines(dragged)
  const nodes = useMemo(
    () => graph.nodes(blocks, notes, findings, pathPrefix, drag, selection),
    [graph, blocks, notes, findings, pathPrefix, drag, selection],
  )
  /** Blocks whose wires the server has not routed again yet. */
  const pendingPlaces = useMemo(
    () => Object.assign({}, ...sent.map(({ places }) => places), drag) as Places,
    [sent, drag],
  )
  const edges = useMemo(
    () =>
      graph.edges({
        blocks,
        wires: drawnWires,
        drag: pendingPlaces,
        lines,
        overdue,
        kinds,
        pathPrefix,
        selectedWires,
        targetWire,
      }),
    [graph, blocks, drawnWires, pendingPlaces, lines, overdue, kinds, pathPrefix, selectedWires, targetWire],
  )
  return { graph, nodes, edges, lines }
}
