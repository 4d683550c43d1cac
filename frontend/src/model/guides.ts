import type { Rectangle } from './free_place'

/** A port on the sheet; `dx`, `dy` is the direction of its signal. */
export interface GuidePort {
  x: number
  y: number
  dx: number
  dy: number
  output: boolean
}

/** A block on the sheet, or several blocks that are moved together. */
export interface GuideShape extends Rectangle {
  ports: readonly GuidePort[]
}

/** A line at a coordinate of one axis, from one position to another along the other axis. */
export interface Guide {
  axis: 'x' | 'y'
  at: number
  from: number
  to: number
}

/** The displacement that aligns a moved shape, and the lines that show the alignment. */
export interface Alignment {
  dx: number
  dy: number
  guides: Guide[]
}

interface Match {
  shift: number
  at: number
  other: GuideShape
}

/**
 * Align a moved shape with others within a distance (px). A straight line between an output and an input
 * comes before the alignment of edges and centres; of each kind the nearest alignment is taken.
 */
export function align(moving: GuideShape, others: readonly GuideShape[], within: number): Alignment {
  const alignment: Alignment = { dx: 0, dy: 0, guides: [] }
  for (const axis of ['x', 'y'] as const) {
    const match =
      nearest(portMatches(moving, others, axis), within) ?? nearest(edgeMatches(moving, others, axis), within)
    if (!match) continue
    alignment[axis === 'x' ? 'dx' : 'dy'] = match.shift
    const along = axis === 'x' ? 'y' : 'x'
    const ends = [moving, match.other].flatMap((shape) => [shape[along], shape[along] + size(shape, along)])
    alignment.guides.push({ axis, at: match.at, from: Math.min(...ends), to: Math.max(...ends) })
  }
  // Each line was computed before the displacement along it.
  for (const guide of alignment.guides) {
    const shift = guide.axis === 'x' ? alignment.dy : alignment.dx
    guide.from += Math.min(shift, 0)
    guide.to += Math.max(shift, 0)
  }
  return alignment
}

const size = (shape: Rectangle, axis: 'x' | 'y') => (axis === 'x' ? shape.width : shape.height)

function* portMatches(moving: GuideShape, others: readonly GuideShape[], axis: 'x' | 'y'): Generator<Match> {
  const across = axis === 'x' ? 'dy' : 'dx'
  for (const port of moving.ports) {
    if (!port[across]) continue
    for (const other of others)
      for (const otherPort of other.ports)
        if (otherPort.output !== port.output && otherPort[across])
          yield { shift: otherPort[axis] - port[axis], at: otherPort[axis], other }
  }
}

function* edgeMatches(moving: GuideShape, others: readonly GuideShape[], axis: 'x' | 'y'): Generator<Match> {
  for (const part of [0.5, 0, 1]) {
    const line = moving[axis] + part * size(moving, axis)
    for (const other of others) {
      const at = other[axis] + part * size(other, axis)
      yield { shift: at - line, at, other }
    }
  }
}

function nearest(matches: Iterable<Match>, within: number): Match | undefined {
  let best: Match | undefined
  for (const match of matches)
    if (Math.abs(match.shift) <= within && (!best || Math.abs(match.shift) < Math.abs(best.shift)))
      best = match
  return best
}
