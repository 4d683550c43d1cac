import { useEffect, useMemo, useRef } from 'react'
import { proposedWire } from '../model/auto_connect'
import { stretchedToPorts, svgPath } from '../model/wire_lines'
import { change, useStudio } from '../store'
import { forgetPlaced, usePlaced } from './placed_block'
import './proposed_line.css'

/**
 * The proposed wire of the block that was placed last, until another selection, such as none after Escape. A
 * click on the wire, or Enter, connects the ports.
 */
export function ProposedLine() {
  const { name, at } = usePlaced()
  const blocks = useStudio((s) => s.document!.blocks)
  const wires = useStudio((s) => s.document!.wires)
  const isSelected = useStudio((s) => s.selection.size === 1 && s.selection.has(name))
  const isReadOnly = useStudio((s) => s.document!.linked.length > 0)
  const isSent = useRef(false)
  const isShown = !isReadOnly && (isSelected || at !== undefined)
  useEffect(() => {
    if (!isShown) forgetPlaced()
  }, [isShown, name])
  useEffect(() => forgetPlaced, [])
  const proposed = useMemo(() => {
    const block = isShown && blocks[name]
    if (!block) return undefined
    return proposedWire({ ...block, place: at ?? block.place }, Object.values(blocks), wires)
  }, [name, at, isShown, blocks, wires])
  if (!proposed) return null
  const { wire, ends } = proposed
  const area = svgPath(pathBetween(inset(ends)))
  const connect = () => {
    // The second click of a double click comes before the reply.
    if (isSent.current) return
    isSent.current = true
    void change({ kind: 'connect', wire }).finally(() => (isSent.current = false))
  }
  return (
    <svg
      className="proposed-line nopan nodrag"
      width="1"
      height="1"
      role="button"
      tabIndex={0}
      aria-label={`Connect ${wire.source} with ${wire.target}`}
      onClick={connect}
      onKeyDown={(event) => {
        if (event.key !== 'Enter') return
        // Enter on the sheet opens the selected block.
        event.stopPropagation()
        connect()
      }}
    >
      <title>{`Connect ${wire.source} with ${wire.target}`}</title>
      <path className="ground" d={area} />
      <path className="area" d={area} />
      <path className="dashes" d={svgPath(pathBetween(ends))} />
    </svg>
  )
}

/** Distance from the ports at which the area for clicks begins, so that ports can still be dragged, px. */
const PORT_AREA = 10

type Ends = NonNullable<ReturnType<typeof proposedWire>>['ends']

/** The ends of a line without the areas of the ports. */
function inset([from, to]: Ends): Ends {
  const distance = from.dx ? Math.abs(to.x - from.x) : Math.abs(to.y - from.y)
  const length = Math.min(PORT_AREA, distance / 3)
  const moved = (end: Ends[0]) => ({ ...end, x: end.x + length * end.dx, y: end.y + length * end.dy })
  return [moved(from), moved(to)]
}

/** The path at right angles between two ports. */
function pathBetween(ends: Ends) {
  const [from, to] = ends
  return stretchedToPorts([[from.x, from.y], from.dx ? [to.x, from.y] : [from.x, to.y]], false, ends)
}
