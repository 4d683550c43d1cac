import { expect, test } from 'vitest'
import { guided, type GuideShape } from '../../src/model/guides'
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

const moved = (one: GuideShape, dx: number, dy: number): GuideShape => ({
  ...one,
  x: one.x + dx,
  y: one.y + dy,
  ports: one.ports.map((port) => ({ ...port, x: port.x + dx, y: port.y + dy })),
})

const lines = (one: GuideShape, axis: 'x' | 'y') => {
  const size = axis === 'x' ? one.width : one.height
  return [0, 0.5, 1].map((part) => one[axis] + part * size)
}

test('an aligned shape is displaced at most by the reach, and lies on its lines', () => {
  let seen = 0
  for (let round = 0; round < 300; round++) {
    const others = Array.from({ length: 8 }, shape)
    const one = shape()
    const found = guided(one, others, REACH)
    expect(Math.max(Math.abs(found.dx), Math.abs(found.dy))).toBeLessThanOrEqual(REACH)
    const there = moved(one, found.dx, found.dy)
    for (const { axis, at, from, to } of found.guides) {
      seen += 1
      const own = [...lines(there, axis), ...there.ports.map((port) => port[axis])]
      expect(Math.min(...own.map((line) => Math.abs(line - at)))).toBeLessThan(1e-9)
      const along = axis === 'x' ? 'y' : 'x'
      expect(from).toBeLessThanOrEqual(lines(there, along)[0]! + 1e-9)
      expect(to).toBeGreaterThanOrEqual(lines(there, along)[2]! - 1e-9)
    }
    // Without ports it is then aligned; with ports, the displacement may bring a port within reach.
    const bare = { ...one, ports: [] }
    const { dx, dy } = guided(bare, others, REACH)
    const again = guided(moved(bare, dx, dy), others, REACH)
    expect(Math.abs(again.dx) + Math.abs(again.dy)).toBeLessThan(1e-9)
  }
  expect(seen).toBeGreaterThan(100)
})

test('a straight line to a port comes before nearer edges, and inputs are not aligned with inputs', () => {
  const other = { ...shape(), x: 0, y: 0, width: 50, height: 40 }
  const port = { x: 50, y: 20, dx: 1, dy: 0, output: true }
  const one = { x: 200, y: 3, width: 50, height: 40, ports: [{ ...port, x: 200, y: 16, output: false }] }
  expect(guided(one, [{ ...other, ports: [port] }], REACH)).toEqual({
    dx: 0,
    dy: 4,
    guides: [{ axis: 'y', at: 20, from: 0, to: 250 }],
  })
  expect(guided(one, [{ ...other, ports: [{ ...port, output: false }] }], REACH).dy).toBe(-3)
})

test('nothing within reach leaves a shape where it is', () => {
  const one = { x: 0, y: 0, width: 10, height: 10, ports: [] }
  expect(guided(one, [{ ...one, x: 50, y: 50 }], REACH)).toEqual({ dx: 0, dy: 0, guides: [] })
})
