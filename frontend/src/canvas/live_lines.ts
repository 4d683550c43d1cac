import { useEffect, useRef, useState } from 'react'
import type { Lines } from '../model/wire_lines'
import type { Places } from '../model/wires'
import type { RouteWires, BlockCorner, Wire } from '../protocol'
import { line, useStudio } from '../store'

/** The layout of a sheet during a drag, which differs from the document. */
interface Dragged {
  places: Places
  /** The displayed wires, if they differ from those of the document. */
  wires: Wire[] | null
  passed: string | null
}

/** Lines that differ from those of the document, which were `base`. */
interface Routed {
  base: Lines
  lines: Lines
}

/** The next request, and whether a request is pending. */
interface Asking {
  wanted: { request: RouteWires; base: Lines } | null
  busy: boolean
  dragging: boolean
}

/** Time without a reply after which the wires of the moved blocks are drawn dashed, ms. */
const LATE_MS = 120

/**
 * The lines of the displayed sheet. During a drag the server routes them: one request at a time, with the
 * latest layout. `late` is true if a reply is overdue.
 */
export function useLiveLines(dragged: Dragged | null): { lines: Lines; late: boolean } {
  const kept = useStudio((s) => s.document!.lines)
  const document = useStudio((s) => s.document!.state.document)
  const inside = useStudio((s) => s.document!.inside)
  const [routed, setRouted] = useState<Routed | null>(null)
  const [late, setLate] = useState(false)
  const asking = useRef<Asking>({ wanted: null, busy: false, dragging: false })
  useEffect(() => {
    const now = asking.current
    now.dragging = dragged !== null
    const request = (of: Dragged): RouteWires => ({
      kind: 'route',
      document,
      inside,
      places: spots(of.places),
      wires: of.wires,
      passed: of.passed,
    })
    now.wanted = dragged && { request: request(dragged), base: kept }
    if (!dragged) {
      setRouted(null)
      setLate(false)
    } else if (!now.busy) void follow(now, setRouted, setLate)
  }, [dragged, document, inside, kept])
  // Lines that were routed before the last change of the document are outdated, as at the end of a drag.
  const lines = dragged && routed?.base === kept ? { ...kept, ...routed.lines } : kept
  return { lines, late: late && dragged !== null }
}

/** Request the lines of the latest layout, until no newer layout is waiting. */
async function follow(
  now: Asking,
  answer: (routed: Routed) => void,
  setLate: (late: boolean) => void,
): Promise<void> {
  now.busy = true
  while (now.wanted) {
    const { request, base } = now.wanted
    now.wanted = null
    const timer = setTimeout(() => setLate(true), LATE_MS)
    // The request is refused if the sheet has changed meanwhile: its lines are sent with the change.
    const lines = await line.ask(request).catch(() => null)
    clearTimeout(timer)
    setLate(false)
    if (lines && now.dragging) answer({ base, lines })
  }
  now.busy = false
}

const spots = (places: Places): Record<string, BlockCorner> =>
  Object.fromEntries(Object.entries(places).map(([name, { x, y }]) => [name, { x, y }]))
