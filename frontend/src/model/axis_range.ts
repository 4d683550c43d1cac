/** Largest end of an axis, so that the length of the range is finite. Larger values are outside. */
const LARGEST = Number.MAX_VALUE / 4
/** Length below which a range is shown as one value: px per unit would not be finite. */
const SHORTEST = 1e-300
/** Margin by which a vertical axis is extended beyond the values during a run, as a fraction of its range. */
const GROWTH_MARGIN = 0.15

type Range = [number, number]

const finite = (value: number): number => Math.min(Math.max(value, -LARGEST), LARGEST)

/** The range of an axis for values from `min` to `max`, with a margin; never empty, with finite ends. */
export function withMargin(min: number, max: number): Range {
  if (!(max >= min)) return [0, 1]
  const [low, high] = [finite(min), finite(max)]
  const largest = Math.max(Math.abs(low), Math.abs(high))
  const length = high - low
  const isConstant = length <= Math.max(1e-12 * largest, SHORTEST)
  const marginOfConstant = largest > SHORTEST ? 0.1 * largest : 1
  const margin = isConstant ? marginOfConstant : 0.06 * length
  return [finite(low - margin), finite(high + margin)]
}

/** Extend a range that is too small, with a margin in the direction of growth: each change redraws all. */
export function withGrowthMargin([low, high]: Range, [before, after]: Range): Range {
  const margin = GROWTH_MARGIN * (Math.max(high, after) - Math.min(low, before))
  return [low < before ? finite(low - margin) : before, high > after ? finite(high + margin) : after]
}
