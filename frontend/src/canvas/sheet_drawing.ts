import { useMemo, useState } from 'react'
import { takenOut } from '../model/rewiring'
import { wireKey, type Places } from '../model/wires'
import type { Finding } from '../protocol'
import { useStudio } from '../store'
import { present, type SheetDrag } from './sheet_drag'
import { SheetGraph } from './sheet_graph'
import { useLiveLines } from './live_lines'
import { useBending } from './wire_edge'

/** The nodes and edges of the visible sheet, including the present drag. */
export function useSheetDrawing({ drag, freed, loose, into }: SheetDrag, chosenWires: ReadonlySet<string>) {
  const blocks = useStudio((s) => s.document!.blocks)
  const wires = useStudio((s) => s.document!.wires)
  const notes = useStudio((s) => s.document!.notes)
  const found = useStudio((s) => s.document!.findings)
  const strict = useStudio((s) => s.strict)
  const findings = useMemo(
    () => (strict ? found.map((one): Finding => ({ ...one, severity: 'error' })) : found),
    [found, strict],
  )
  const kinds = useStudio((s) => s.document!.wireKinds)
  const level = useStudio((s) => s.document!.inside.map((name) => `${name}/`).join(''))
  const selection = useStudio((s) => s.selection)
  const sent = useStudio((s) => s.sent)
  const bending = useBending((s) => s.wire)
  const [graph] = useState(() => new SheetGraph())
  const shown = useMemo(() => {
    if (bending) return wires.map((wire) => (wireKey(wire) === wireKey(bending) ? bending : wire))
    return freed.length ? takenOut(present(blocks, freed), wires) : wires
  }, [wires, bending, freed, blocks])
  const dragged = useMemo(
    () =>
      shown === wires && loose === null && !Object.keys(drag).length
        ? null
        : { places: drag, wires: shown === wires ? null : shown, passed: loose },
    [drag, shown, wires, loose],
  )
  const { lines, late } = useLiveLines(dragged)
  const nodes = useMemo(
    () => graph.nodes(blocks, notes, findings, level, drag, selection),
    [graph, blocks, notes, findings, level, drag, selection],
  )
  /** Blocks whose wires the server has not routed again yet. */
  const moved = useMemo(
    () => Object.assign({}, ...sent.map(({ places }) => places), drag) as Places,
    [sent, drag],
  )
  const edges = useMemo(
    () =>
      graph.edges({
        blocks,
        wires: shown,
        drag: moved,
        lines,
        late,
        kinds,
        level,
        chosen: chosenWires,
        into,
      }),
    [graph, blocks, shown, moved, lines, late, kinds, level, chosenWires, into],
  )
  return { graph, nodes, edges, lines }
}
