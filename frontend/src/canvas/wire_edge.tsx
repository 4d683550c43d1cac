import { BaseEdge, EdgeLabelRenderer, useReactFlow, type Edge, type EdgeProps } from '@xyflow/react'
import { memo } from 'react'
import { create } from 'zustand'
import type { Wire } from '../protocol'
import { change } from '../store'
import { dragged } from '../model/bends'
import { drawBranch } from './branching'
import { GRID } from './insert'
import { followPointer } from './pointer_drag'
import { nameSignal } from './signal_names'
import { isHorizontal, svgPath, type Point, type PortPosition } from '../model/wire_lines'

export type WireEdgeType = Edge<
  {
    path: readonly Point[]
    dots: readonly Point[]
    /** The number of axes of the signal: 0 scalar, 1 vector, 2 matrix; 3 for a bus. */
    rank: number
    /** Whether the line connects frame ports. */
    frame: boolean
    label: string
    bent: boolean
    /** Whether the server has not routed the wire yet. */
    pending: boolean
    /** The labels at the ports of a wire without a line. */
    tags: readonly WireTag[]
    /**
     * The complete route from the source; `path` is its last part if the wire branches from another wire.
     */
    route: () => Point[]
  },
  'wire'
>

/** A label at a port. */
export interface WireTag extends PortPosition {
  text: string
}

/** The wire whose route is being drawn, with its present bends. */
export const useBending = create<{ wire: Required<Wire> | null }>(() => ({ wire: null }))

/** End the drawing of a route, unless another drawing has begun. */
function endBending(wire: Required<Wire>): void {
  if (useBending.getState().wire === wire) useBending.setState({ wire: null })
}

/** Distance within which a dragged segment is aligned with a parallel segment, px. */
const SNAP_PX = 7

/**
 * A wire on its route: thin for a scalar, thicker for a vector, double for a matrix, three lines for a bus. A
 * frame line has its own colour and no arrow head. Segments can be dragged.
 */
export const WireEdge = memo(function WireEdge({ id, data, selected }: EdgeProps<WireEdgeType>) {
  if (!data) return null
  const { path, rank, frame } = data
  const line = svgPath(path, data.dots)
  const states = ['wire', frame && 'frame', selected && 'selected', data.pending && 'pending']
  const className = states.filter(Boolean).join(' ')
  const name = () => frame || nameSignal(id.slice(0, id.indexOf(' -> ')))
  if (!path.length)
    return (
      <g className={className} onDoubleClick={name}>
        {data.tags.map((tag) => (
          <Tag key={`${tag.x} ${tag.y}`} tag={tag} selected={Boolean(selected)} />
        ))}
        <title>{data.label}</title>
      </g>
    )
  return (
    <g className={className} onDoubleClick={name}>
      <BaseEdge
        id={id}
        path={line}
        className={`line rank${rank}`}
        {...(frame ? {} : { markerEnd: selected ? 'url(#selected-wire-head)' : 'url(#wire-head)' })}
        interactionWidth={0}
      />
      {rank >= 2 && <path d={line} className={rank === 3 ? 'core wide' : 'core'} />}
      {rank === 3 && <path d={line} className="line rank0 inner" />}
      {data.dots.map(([x, y]) => (
        <circle key={`${x} ${y}`} cx={x} cy={y} r={2.6 + 0.3 * rank} className="dot" />
      ))}
      {path.slice(1).map((_, segment) => (
        <Segment key={segment} id={id} path={path} segment={segment} data={data} />
      ))}
      <title>{data.label}</title>
    </g>
  )
})

/** Length of the dashed stub from a port to the label of a wire without a line, px, as in `wire_marks`. */
const TAG_STUB = 8

/** A dashed stub at a port, and a label with the name of the connected port, drawn above the blocks. */
function Tag({ tag: { x, y, dx, dy, text }, selected }: { tag: WireTag; selected: boolean }) {
  const [tx, ty] = [x + TAG_STUB * dx, y + TAG_STUB * dy]
  const shift = `translate(${50 * (dx - 1)}%, ${50 * (dy - 1)}%)`
  return (
    <>
      <line x1={x} y1={y} x2={tx} y2={ty} className="line rank0 stub" />
      <line x1={x} y1={y} x2={tx} y2={ty} className="segment" />
      <EdgeLabelRenderer>
        <span
          className={selected ? 'wire-tag selected' : 'wire-tag'}
          style={{ transform: `translate(${tx}px, ${ty}px) ${shift}` }}
        >
          {text}
        </span>
      </EdgeLabelRenderer>
    </>
  )
}

/** One segment of a wire, which can be dragged. */
function Segment({
  id,
  path,
  segment,
  data: { route, frame },
}: {
  id: string
  path: readonly Point[]
  segment: number
  data: Pick<NonNullable<WireEdgeType['data']>, 'route' | 'frame'>
}) {
  const flow = useReactFlow()
  const [[x1, y1], [x2, y2]] = [path[segment]!, path[segment + 1]!]
  const horizontal = isHorizontal(path, segment)
  const startDrag = (event: React.PointerEvent<SVGLineElement>) => {
    if (event.button !== 0) return
    // The route of a frame line has no bends: a drag draws a branch.
    if (event.ctrlKey || event.metaKey || frame) {
      drawBranch(flow, id.slice(0, id.indexOf(' -> ')), path, event)
      return
    }
    const complete = route()
    const index = complete.length - path.length + segment
    if (index < 0 || index > complete.length - 2) return
    const [source, target] = [id.slice(0, id.indexOf(' -> ')), id.slice(id.indexOf(' -> ') + 4)]
    const start = { x: event.clientX, y: event.clientY }
    const sheet = event.currentTarget.closest<HTMLElement>('.react-flow')!
    const move = (pointer: PointerEvent) => {
      const distance = horizontal ? pointer.clientY - start.y : pointer.clientX - start.x
      if (Math.abs(distance) < 3 && !useBending.getState().wire) return
      // The sheet captures the pointer: this segment may disappear while the route is being drawn.
      sheet.setPointerCapture(event.pointerId)
      const point = flow.screenToFlowPosition(
        { x: pointer.clientX, y: pointer.clientY },
        { snapToGrid: false },
      )
      useBending.setState({
        wire: {
          source,
          target,
          bends: dragged(complete, index, snapped(complete, index, horizontal ? point.y : point.x)),
        },
      })
    }
    followPointer(event, {
      move,
      drop: () => {
        const { wire } = useBending.getState()
        // The drawn route remains until the server has applied it.
        if (wire) void change({ kind: 'bend', wires: [wire] }).finally(() => endBending(wire))
      },
      finish: (dropped) => dropped || useBending.setState({ wire: null }),
    })
  }
  return (
    <line
      x1={x1}
      y1={y1}
      x2={x2}
      y2={y2}
      className={horizontal ? 'segment nopan horizontal' : 'segment nopan'}
      onPointerDown={startDrag}
    />
  )
}

/**
 * The position of a dragged segment: aligned with a nearby parallel segment, otherwise on the grid.
 */
function snapped(route: Point[], segment: number, coordinate: number): number {
  const axis = isHorizontal(route, segment) ? 1 : 0
  const others = route.filter((_, k) => k !== segment && k !== segment + 1).map((point) => point[axis])
  const aligned = others.find((other) => Math.abs(other - coordinate) < SNAP_PX)
  return aligned ?? GRID * Math.round(coordinate / GRID)
}
