import { expect, test } from 'vitest'
import { IncrementalDrawing, type DrawnPlot } from '../../src/model/incremental_drawing'
import { RunSamples } from '../../src/model/run_samples'
import { extremes, tracesOf, type PlotColumns } from '../../src/model/trace'
import type { Channel } from '../../src/protocol'

const TIME = Float64Array.from({ length: 5000 }, (_, k) => k / 1000)
const VALUES = TIME.map((t) => Math.sin(40 * t) + 0.2 * Math.sin(911 * t))
const until = (count: number) => ({ time: TIME.subarray(0, count), values: VALUES.subarray(0, count) })

test('extremes extended during a run equal those of the whole run', () => {
  let grown = extremes([until(1)], 0, 5, 300)
  for (const count of [7, 8, 900, 901, 3333, 5000]) {
    grown = extremes([until(count)], 0, 5, 300, grown)
    expect(grown.columns).toEqual(extremes([until(count)], 0, 5, 300).columns)
  }
})

test('no peak is lost, and each interval has at most two points', () => {
  const { columns } = extremes([until(5000)], 0, 5, 50)
  const shown = (columns[1] as (number | undefined)[]).filter((value) => value !== undefined)
  expect(shown.length).toBeLessThanOrEqual(100)
  expect([Math.min(...shown), Math.max(...shown)]).toEqual([Math.min(...VALUES), Math.max(...VALUES)])
})

/** A canvas that records the drawn lines and their initial dash offsets. */
function surface() {
  const strokes: { points: [number, number][]; offset: number }[] = []
  const ctx: CanvasRenderingContext2D = {
    lineDashOffset: 0,
    beginPath: () => strokes.push({ points: [], offset: NaN }),
    moveTo: (x: number, y: number) => strokes.at(-1)!.points.push([x, y]),
    lineTo: (x: number, y: number) => strokes.at(-1)!.points.push([x, y]),
    stroke: () => {
      strokes.at(-1)!.offset = ctx.lineDashOffset
    },
    ...Object.fromEntries(
      ['save', 'restore', 'rect', 'clip', 'translate', 'setLineDash'].map((name) => [name, () => {}]),
    ),
  } as unknown as CanvasRenderingContext2D
  const plot: DrawnPlot = {
    ctx,
    bbox: { left: 0, top: 0, width: 500, height: 100 },
    valToPos: (value, scale) => (scale === 'x' ? 100 * value : 50 - 40 * value),
  }
  return { plot, drawn: () => strokes.filter(({ points }) => points.length > 0) }
}

const withoutValues = (grown: { columns: PlotColumns }): PlotColumns => [
  grown.columns[0],
  grown.columns[0].map(() => NaN),
]

test('a line drawn in parts equals the line drawn at once, dashes included', () => {
  const strokes = [{ colour: 'black', dash: [7, 3] }]
  const whole = surface()
  const all = extremes([until(5000)], 0, 5, 300)
  const once = new IncrementalDrawing(whole.plot, strokes)
  once.reset(withoutValues(all), [0])
  once.append(all.columns, 1, all.finalRows, 1)

  const parts = surface()
  const growing = new IncrementalDrawing(parts.plot, strokes)
  growing.reset(withoutValues(all), [0])
  let grown = extremes([until(1)], 0, 5, 300)
  for (const count of [400, 401, 2600, 5000]) {
    grown = extremes([until(count)], 0, 5, 300, grown)
    growing.append(grown.columns, 1, grown.finalRows, 1)
  }
  const drawnParts = parts.drawn()
  expect(drawnParts.length).toBeGreaterThan(1)
  drawnParts.slice(1).forEach(({ points }, k) => expect(points[0]).toEqual(drawnParts[k]!.points.at(-1)))
  const joined = drawnParts.flatMap(({ points }, k) => (k ? points.slice(1) : points))
  expect(joined).toEqual(whole.drawn()[0]!.points)
  const length = (points: [number, number][]) =>
    points.slice(1).reduce((sum, [x, y], k) => sum + Math.hypot(x - points[k]![0], y - points[k]![1]), 0)
  let before = 0
  for (const { points, offset } of drawnParts) {
    expect(offset, 'the dashes continue without a jump').toBeCloseTo(before, 9)
    before += length(points)
  }
})

test('points of a line lie between pixels where the values do', () => {
  const { plot, drawn } = surface()
  const growing = new IncrementalDrawing(plot, [{ colour: 'black', dash: [] }])
  const slow: PlotColumns = [Float64Array.of(0, 1.005, 2), [0, 0.0012, 0.0037]]
  growing.reset(withoutValues({ columns: slow }), [0])
  growing.append(slow, 1, [3], 1)
  expect(drawn()[0]!.points).toEqual([
    [0, 50],
    [100 * 1.005, 50 - 40 * 0.0012],
    [200, 50 - 40 * 0.0037],
  ])
})

/** A sample frame in the format of the server: header, instants, columns. */
function frame(run: string, first: number, time: number[], columns: number[][]): ArrayBuffer {
  const header = JSON.stringify({ run, first, count: time.length })
  const text = new TextEncoder().encode(header.padEnd(Math.ceil((header.length + 4) / 8) * 8 - 4))
  const grown = new ArrayBuffer(4 + text.length + 8 * time.length * (1 + columns.length))
  new DataView(grown).setUint32(0, text.length, true)
  new Uint8Array(grown, 4).set(text)
  new Float64Array(grown, 4 + text.length).set([...time, ...columns.flat()])
  return grown
}

test('samples are added by frames, dropped by a step back, and found by name', () => {
  const channel = (name: string, shape: number[]): Channel => ({ name, shape, unit: 'rad', entries: [] })
  const run = new RunSamples('r', [channel('arm/q', [2]), channel('clock/y', [])], { arm: 'arm/q' })
  run.receive(
    frame(
      'r',
      0,
      [0, 1],
      [
        [1, 2],
        [3, 4],
        [5, 6],
      ],
    ),
  )
  run.receive(frame('other', 0, [9], [[9], [9], [9]]))
  run.receive(frame('r', 2, [2], [[7], [8], [9]]))
  expect([...run.signal('arm')!.columns[1]!]).toEqual([3, 4, 8])
  expect([run.indexAt(-1), run.indexAt(1.5), run.indexAt(7)]).toEqual([-1, 1, 2])
  expect(run.title('arm/q')).toBe('arm')
  run.truncate(2)
  expect([...run.signal('clock/y')!.time]).toEqual([0, 1])
  const traces = tracesOf(run, [
    { path: 'arm/q', label: '' },
    { path: 'clock/y', label: 't' },
    { path: 'gone', label: '' },
  ])
  expect(traces.map(({ label, tone, dash }) => [label, tone, dash])).toEqual([
    ['arm 1', 'trace-0', []],
    ['arm 2', 'trace-1', []],
    ['t', 'trace-0', [7, 3]],
  ])
  const named = new RunSamples('r', [{ ...channel('arm/q', [2]), entries: ['shoulder', 'elbow'] }], {})
  named.receive(frame('r', 0, [0], [[1], [2]]))
  expect(tracesOf(named, [{ path: 'arm/q', label: '' }]).map(({ label }) => label)).toEqual([
    'arm/q shoulder',
    'arm/q elbow',
  ])
})
