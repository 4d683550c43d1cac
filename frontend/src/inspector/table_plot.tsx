import type { TablePreview } from '../protocol'

/** Size of the plot, px. */
const WIDTH = 560
const HEIGHT = 96
const COLOURS = 8

/** The tone of a curve, `trace-0`. */
export const traceTone = (curve: number): string => `trace-${curve % COLOURS}`

/** A small plot of all values over time, on one common scale. */
export function TablePlot({ preview: { times, curves, chosen } }: { preview: TablePreview }) {
  const values = curves.flat()
  const [left, right] = [times[0] ?? 0, times.at(-1) ?? 1]
  let [low, high] = [Math.min(...values), Math.max(...values)]
  if (low === high) [low, high] = [low - 1, high + 1]
  const x = (time: number) => (WIDTH * (time - left)) / (right - left || 1)
  const y = (value: number) => HEIGHT - 4 - ((HEIGHT - 8) * (value - low)) / (high - low)
  return (
    <div className="data-plot">
      <svg
        viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={`Plot of ${chosen.slice(0, curves.length).join(', ')}`}
      >
        {curves.map((curve, number) => (
          <polyline
            key={chosen[number]}
            points={curve.map((value, k) => `${x(times[k]!).toFixed(2)},${y(value).toFixed(2)}`).join(' ')}
            className={`s-${traceTone(number)}`}
            fill="none"
            strokeWidth={1.3}
            vectorEffect="non-scaling-stroke"
          />
        ))}
      </svg>
      <span className="numbers top">{numberText(high)}</span>
      <span className="numbers bottom">{numberText(low)}</span>
    </div>
  )
}

const numberText = (value: number): string => String(Number(value.toPrecision(4)))
