import { useEffect, useLayoutEffect, useMemo, useRef } from 'react'
import { createPortal } from 'react-dom'
import { proposedWire } from '../model/auto_connect'
import { stretchedToPorts, svgPath } from '../model/wire_lines'
import { focusBlock, isForSheet } from '../sheet_focus'
import { change, useStudio } from '../store'
import { forgetPlaced, usePlaced } from './placed_block'
import './proposed_line.css'

/**
 * The proposed wire of the block that was placed last, until Escape or another selection. A click on the wire
 * connects the ports. Tab moves the focus from the block to the wire; Enter or space then connects the ports.
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
  const line = useRef<SVGSVGElement>(null)
  const isOffered = proposed !== undefined && at === undefined
  useLineKeys(line, name, isOffered)
  const title = proposed ? `Connect ${proposed.wire.source} with ${proposed.wire.target}` : ''
  const announcement = createPortal(
    <span className="announced" role="status">
      {isOffered && `${title}: press Tab, then Enter`}
    </span>,
    document.body,
  )
  if (!proposed) return announcement
  const { wire, ends } = proposed
  const area = svgPath(pathBetween(inset(ends)))
  const connect = () => {
    // The second click of a double click comes before the reply.
    if (isSent.current) return
    isSent.current = true
    void change({ kind: 'connect', wire }).finally(() => (isSent.current = false))
  }
  return (
    <>
      {announcement}
      <svg
        ref={line}
        className="proposed-line nopan nodrag"
        width="1"
        height="1"
        role="button"
        tabIndex={0}
        aria-label={title}
        onClick={connect}
        onKeyDown={(event) => {
          if (event.key !== 'Enter' && event.key !== ' ') return
          // Enter on the sheet opens the selected block, and space fits the sheet.
          event.preventDefault()
          event.stopPropagation()
          focusBlock(name)
          connect()
        }}
      >
        <title>{title}</title>
        <path className="ground" d={area} />
        <path className="area" d={area} />
        <path className="dashes" d={svgPath(pathBetween(ends))} />
      </svg>
    </>
  )
}

/**
 * While a wire is offered: Tab moves the focus from the placed block to the line, and from the line to the
 * next block; Shift+Tab moves it back to the placed block. Escape removes the line and keeps the selection.
 */
function useLineKeys(line: React.RefObject<SVGSVGElement | null>, name: string, isOffered: boolean): void {
  // A layout effect: the next key may be held until the block is shown.
  useLayoutEffect(() => {
    if (!isOffered) return
    const onKeyDown = (event: KeyboardEvent) => {
      const { key, shiftKey, target, defaultPrevented } = event
      if (defaultPrevented || !(target instanceof Element) || !isForSheet(event)) return
      const isOnLine = target === line.current
      if (key === 'Escape') {
        forgetPlaced()
        focusBlock(name)
      } else if (key === 'Tab' && isOnLine) {
        focusBlock(name)
        // The browser moves the focus from the placed block to the next one.
        if (!shiftKey) return
      } else if (key === 'Tab' && !shiftKey && target.matches('.react-flow__node, :has(.canvas)'))
        line.current?.focus({ preventScroll: true })
      else return
      event.preventDefault()
      event.stopPropagation()
    }
    // At the document: after the cancellation of drags, before the keys of the sheet.
    document.addEventListener('keydown', onKeyDown)
    return () => document.removeEventListener('keydown', onKeyDown)
  }, [line, name, isOffered])
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
