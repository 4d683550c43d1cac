import { unpackedFloats } from './packed'

interface MotionData {
  time: number[]
  rows: number
  poses: string
}

/** The poses of the links along a planned motion. */
export class MotionPoses {
  private readonly poses: Float32Array

  constructor(private readonly motion: MotionData) {
    this.poses = unpackedFloats(motion.poses)
  }

  /** Index of the sample nearest to a time, s. */
  indexAt(time: number): number {
    const { time: times } = this.motion
    const last = times.length - 1
    const end = times[last] ?? 0
    if (!(end > 0)) return 0
    return Math.min(last, Math.max(0, Math.round((time / end) * last)))
  }

  /** Poses of base, links and tool at a sample: (rows, 4, 4). */
  at(index: number): number[][][] {
    const { rows } = this.motion
    return Array.from({ length: rows }, (_, row) => {
      const first = 12 * (rows * index + row)
      const line = (k: number) => Array.from(this.poses.subarray(first + 4 * k, first + 4 * k + 4))
      return [line(0), line(1), line(2), [0, 0, 0, 1]]
    })
  }

  /** Position of the tool at a sample, m. */
  tool(index: number): [number, number, number] {
    const { rows } = this.motion
    const first = 12 * (rows * index + rows - 1)
    return [this.poses[first + 3]!, this.poses[first + 7]!, this.poses[first + 11]!]
  }
}

/** A value in percent of its limit, or undefined without a limit. */
export function shareOf(value: number, limit: number | null): number | undefined {
  return limit === null || !(limit > 0) ? undefined : (100 * value) / limit
}

/** Distance to a limit from which a coordinate is at its limit, relative to its range. */
const CLOSE = 1e-6

/** Whether a coordinate is at or beyond one of its limits. */
export function isAtLimit(value: number, low: number | null, high: number | null): boolean {
  const close = CLOSE * (low !== null && high !== null ? high - low : 1)
  return (low !== null && value <= low + close) || (high !== null && value >= high - close)
}
