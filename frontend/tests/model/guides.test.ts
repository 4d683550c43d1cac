import { expect, test } from 'vitest'
import { align, type GuideShape } from '../../src/model/guides'
import { seeded } from './random'

const random = seeded(11)
const REACH = 6

function shape(): GuideShape {
  const [x, y, width, height] = [600 * random(), 400 * random(), 20 + 80 * random(), 20 + 60 * random()]
  const level = y + height * random()
  return {
    x,
    y,
    width,
    height,
    ports: [
      { x, y: level, dx: 1, dy: 0, output: false },
      { x: x + width, y: level, dx: 1, dy: 0, output: true },
    ],
  }
}

const displaced = (guided: GuideShape, dx: number, dy: number): GuideShape => ({
  ...guided,
  x: guided.x + dx,
  y: guided.y + dy,
  ports: guided.ports.map((port) => ({ ...port, x: port.x + dx, y: port.y + dy })),
})

const lines = (guideShape: GuideShape, axis: 'x' | 'y') => {
  const size = axis === 'x' ? guideShape.width : guideShape.height
  return [0, 0.5, 1].map((part) => guideShape[axis] + part * size)
}

test('an aligned shape is displaced at most by the reach, and lies on its lines', () => {
  let guideCount = 0
  for (let round = 0; round < 300; round++) {
    const others = Array.from({ length: 8 }, shape)
    const guided = shape()
    const alignment = align(guided, others, REACH)
    expect(Math.max(Math.abs(alignment.dx), Math.abs(alignment.dy))).toBeLessThanOrEqual(REACH)
    const aligned = displaced(guided, alignment.dx, alignment.dy)
    for (const { axis, at, from, to } of alignment.guides) {
      guideCount += 1
      const coordinates = [...lines(aligned, axis), ...aligned.ports.map((port) => port[axis])]
      expect(Math.min(...coordinates.map((line) => Math.abs(line - at)))).toBeLessThan(1e-9)
      const along = axis === 'x' ? 'y' : 'x'
      expect(from).toBeLessThanOrEqual(lines(aligned, along)[0]! + 1e-9)
      expect(to).toBeGreaterThanOrEqual(lines(aligned, along)[2]! - 1e-9)
    }
    // Without ports it is then aligned; with ports, the displacement may bring a port within reach.
    const bare = { ...guided, ports: [] }
    const { dx, dy } = align(bare, others, REACH)
    const second = align(displaced(bare, dx, dy), others, REACH)
    expect(Math.abs(second.dx) + Math.abs(second.dy)).toBeLessThan(1e-9)
  }
  expect(guideCount).toBeGreaterThan(100)
})

test('a straight line to a port comes before nearer edges, and inputs are not aligned with inputs', () => {
  const other = { ...shape(), x: 0, y: 0, width: 50, height: 40 }
  const port = { x: 50, y: 20, dx: 1, dy: 0, output: true }
  const guided = { x: 200, y: 3, width: 50, height: 40, ports: [{ ...port, x: 200, y: 16, output: false }] }
  expect(align(guided, [{ ...other, ports: [port] }], REACH)).toEqual({
    dx: 0,
    dy: 4,
    guides: [{ axis: 'y', at: 20, from: 0, to: 250 }],
  })
  expect(align(guided, [{ ...other, ports: [{ ...port, output: false }] }], REACH).dy).toBe(-3)
})

test('a shape without other shapes within reach is not displaced', () => {
  const guided = { x: 0, y: 0, width: 10, height: 10, ports: [] }
  expect(align(guided, [{ ...guided, x: 50, y: 50 }], REACH)).toEqual({ dx: 0, dy: 0, guides: [] })
})
