import { useEffect, useRef, useState } from 'react'
import type { Lines } from '../model/wire_lines'
import type { Places } from '../model/wires'
import type { RouteWires, Spot, Wire } from '../protocol'
import { line, useStudio } from '../store'

/** A sheet that is not as in the document, because something is dragged. */
interface Dragged {
  places: Places
  /** The wires that are shown, where these are not those of the document. */
  wires: Wire[] | null
  passed: string | null
}

/** The request that comes next, and whether one is on its way. */
interface Asking {
  wanted: RouteWires | null
  busy: boolean
  dragging: boolean
}

/** After this long without an answer the wires of the moved blocks are drawn dashed. */
const LATE_MS = 120

/**
 * The lines of the sheet on the screen. While something is dragged the server routes them: one request at a
 * time, always of the latest layout. `late` says that no answer has come for a while.
 */
export function useLiveLines(dragged: Dragged | null): { lines: Lines; late: boolean } {
  const kept = useStudio((s) => s.document!.lines)
  const document = useStudio((s) => s.document!.state.document)
  const inside = useStudio((s) => s.document!.inside)
  const [routed, setRouted] = useState<Lines | null>(null)
  const [late, setLate] = useState(false)
  const asking = useRef<Asking>({ wanted: null, busy: false, dragging: false })
  useEffect(() => {
    const now = asking.current
    now.dragging = dragged !== null
    now.wanted = dragged && {
      kind: 'route',
      document,
      inside,
      places: spots(dragged.places),
      wires: dragged.wires,
      passed: dragged.passed,
    }
    if (!dragged) {
      setRouted(null)
      setLate(false)
    } else if (!now.busy) void follow(now, setRouted, setLate)
  }, [dragged, document, inside])
  const lines = dragged && routed ? { ...kept, ...routed } : kept
  return { lines, late: late && dragged !== null }
}

/** Ask for the lines of the latest layout, until there is no later one. */
async function follow(
  now: Asking,
  answer: (lines: Lines) => void,
  setLate: (late: boolean) => void,
): Promise<void> {
  now.busy = true
  while (now.wanted) {
    const { wanted } = now
    now.wanted = null
    const timer = setTimeout(() => setLate(true), LATE_MS)
    // A refusal means that the sheet has changed meanwhile: its lines come with the change.
    const lines = await line.ask(wanted).catch(() => null)
    clearTimeout(timer)
    setLate(false)
    if (lines && now.dragging) answer(lines)
  }
  now.busy = false
}

const spots = (places: Places): Record<string, Spot> =>
  Object.fromEntries(Object.entries(places).map(([name, { x, y }]) => [name, { x, y }]))
