import { useEffect, useRef, useState } from 'react'
import type { Lines } from '../model/wire_lines'
import type { Places } from '../model/wires'
import type { RouteWires, BlockCorner, Wire } from '../protocol'
import { connection, useStudio } from '../store'

/** The layout of a sheet during a drag, which differs from the document. */
interface DraggedLayout {
  places: Places
  /** The displayed wires, if they differ from the wires of the document. */
  wires: Wire[] | null
  passed: string | null
}

/** Routed lines that differ from `base`, the lines of the document at the time of the request. */
interface Routed {
  base: Lines
  lines: Lines
}

/** The next request, and whether a request is pending. */
interface RouteRequests {
  next: { request: RouteWires; base: Lines } | null
  pending: boolean
  dragging: boolean
}

/** Time without a reply after which the wires of the moved blocks are drawn dashed, ms. */
const OVERDUE_MS = 120

/**
 * The lines of the displayed sheet. During a drag the server routes them: one request at a time, with the
 * latest layout. `overdue` is true if a reply is overdue.
 */
export function useLiveLines(dragged: DraggedLayout | null): { lines: Lines; overdue: boolean } {
  const documentLines = useStudio((s) => s.document!.lines)
  const document = useStudio((s) => s.document!.state.document)
  const inside = useStudio((s) => s.document!.inside)
  const [routed, setRouted] = useState<Routed | null>(null)
  const [overdue, setOverdue] = useState(false)
  const requests = useRef<RouteRequests>({ next: null, pending: false, dragging: false })
  useEffect(() => {
    const state = requests.current
    state.dragging = dragged !== null
    const request = (layout: DraggedLayout): RouteWires => ({
      kind: 'route',
      document,
      inside,
      places: positions(layout.places),
      wires: layout.wires,
      passed: layout.passed,
    })
    state.next = dragged && { request: request(dragged), base: documentLines }
    if (!dragged) {
      setRouted(null)
      setOverdue(false)
    } else if (!state.pending) void requestRoutes(state, setRouted, setOverdue)
  }, [dragged, document, inside, documentLines])
  // Lines that were routed before the last change of the document are outdated, as at the end of a drag.
  const lines =
    dragged && routed?.base === documentLines ? { ...documentLines, ...routed.lines } : documentLines
  return { lines, overdue: overdue && dragged !== null }
}

/** Request the lines of the latest layout, until no newer layout is waiting. */
async function requestRoutes(
  state: RouteRequests,
  setRouted: (routed: Routed) => void,
  setOverdue: (overdue: boolean) => void,
): Promise<void> {
  state.pending = true
  while (state.next) {
    const { request, base } = state.next
    state.next = null
    const timer = setTimeout(() => setOverdue(true), OVERDUE_MS)
    // The request is refused if the sheet has changed meanwhile: its lines are sent with the change.
    const lines = await connection.ask(request).catch(() => null)
    clearTimeout(timer)
    setOverdue(false)
    if (lines && state.dragging) setRouted({ base, lines })
  }
  state.pending = false
}

const positions = (places: Places): Record<string, BlockCorner> =>
  Object.fromEntries(Object.entries(places).map(([name, { x, y }]) => [name, { x, y }]))
