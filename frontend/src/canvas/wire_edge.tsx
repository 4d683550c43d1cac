import { BaseEdge, type Edge, type EdgeProps } from '@xyflow/react'
import { memo } from 'react'
import { svgPath, type Point } from './router'

export type WireEdgeType = Edge<{ path: Point[]; dots: Point[]; rank: number; label: string }, 'wire'>

/** A wire along its routed path: thin for a scalar, heavier for a vector, double for a matrix. */
export const WireEdge = memo(function WireEdge({ id, data, selected, sourceX, sourceY, targetX, targetY }: EdgeProps<WireEdgeType>) {
  const path = data?.path.length ? data.path : ([[sourceX, sourceY], [targetX, targetY]] as Point[])
  const rank = Math.min(data?.rank ?? 0, 2)
  const line = svgPath(path)
  return (
    <g className={selected ? 'wire selected' : 'wire'}>
      <BaseEdge id={id} path={line} className={`line rank${rank}`} markerEnd="url(#wire-head)" interactionWidth={14} />
      {rank === 2 && <path d={line} className="core" />}
      {data?.dots.map(([x, y]) => (
        <circle key={`${x} ${y}`} cx={x} cy={y} r={2.6 + 0.3 * rank} className="dot" />
      ))}
      {data?.label && <title>{data.label}</title>}
    </g>
  )
})
