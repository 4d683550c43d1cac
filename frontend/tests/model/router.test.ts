import { describe, expect, test } from 'vitest'
import { dragged, wholeWay } from '../../src/model/bends'
import { bent, route, type Net, type Obstacle, type Point, type WireEnd } from '../../src/model/router'

const box = (x: number, y: number): Obstacle => ({ x, y, width: 60, height: 40, label: [x, y + 42, 60, 16] })
const output = ({ x, y, width, height }: Obstacle): WireEnd => ({
  x: x + width,
  y: y + height / 2,
  dx: 1,
  dy: 0,
})
const input = ({ x, y, height }: Obstacle): WireEnd => ({ x, y: y + height / 2, dx: 1, dy: 0 })
const net = (key: string, from: Obstacle, ...to: Obstacle[]): Net => ({
  key,
  source: output(from),
  targets: to.map((block, k) => ({ key: `${key} ${k}`, end: input(block) })),
})

/** Whether a straight piece runs through the inside of a block. */
const enters = ([ax, ay]: Point, [bx, by]: Point, o: Obstacle): boolean =>
  Math.max(ax, bx) > o.x &&
  Math.min(ax, bx) < o.x + o.width &&
  Math.max(ay, by) > o.y &&
  Math.min(ay, by) < o.y + o.height

/** Whether two ways lie on each other along a piece. */
function overlap(one: readonly Point[], other: readonly Point[]): boolean {
  const pieces = (way: readonly Point[]) => way.slice(1).map((to, k) => [way[k]!, to] as const)
  return pieces(one).some(([a, b]) =>
    pieces(other).some(([c, d]) =>
      [0, 1].some((axis) => {
        const level = 1 - axis
        if (a[level] !== b[level] || c[level] !== d[level] || a[level] !== c[level]) return false
        const begin = Math.max(Math.min(a[axis]!, b[axis]!), Math.min(c[axis]!, d[axis]!))
        return begin < Math.min(Math.max(a[axis]!, b[axis]!), Math.max(c[axis]!, d[axis]!))
      }),
    ),
  )
}

function expectWay(way: readonly Point[], from: WireEnd, to: WireEnd, blocks: Obstacle[]): void {
  expect(way[0]).toEqual([from.x, from.y])
  expect(way.at(-1)).toEqual([to.x, to.y])
  for (let k = 1; k < way.length; k++) {
    const [a, b] = [way[k - 1]!, way[k]!]
    expect(a[0] === b[0] || a[1] === b[1], 'each piece is level or upright').toBe(true)
    expect(
      blocks.some((block) => enters(a, b, block)),
      'no piece runs through a block',
    ).toBe(false)
  }
  expect(way[1]![0], 'the wire leaves in the direction of its port').toBeGreaterThan(from.x)
  expect(way.at(-2)![0], 'and arrives in that of the other').toBeLessThan(to.x)
}

/** Numbers in [0, 1) that look random and are the same each time (mulberry32). */
function random(seed: number): () => number {
  let state = seed
  return () => {
    state = (state + 0x6d2b79f5) | 0
    let t = Math.imul(state ^ (state >>> 15), 1 | state)
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32
  }
}

describe('the router', () => {
  test('draws a straight line where nothing is in the way', () => {
    const [a, b] = [box(0, 0), box(200, 0)]
    expect(route([a, b], [net('n', a, b)]).get('n')).toEqual({
      paths: new Map([
        [
          'n 0',
          [
            [60, 20],
            [200, 20],
          ],
        ],
      ]),
      dots: [],
    })
  })

  test('leads around a block in between, and back to a block on the left', () => {
    const [a, between, b] = [box(0, 0), box(150, 0), box(300, 0)]
    const blocks = [a, between, b]
    const routed = route(blocks, [net('forward', a, b), net('back', b, a)])
    expectWay(routed.get('forward')!.paths.get('forward 0')!, output(a), input(b), blocks)
    expectWay(routed.get('back')!.paths.get('back 0')!, output(b), input(a), blocks)
  })

  test('branches at a dot, from which the whole way of each wire follows', () => {
    const [a, b, c] = [box(0, 0), box(300, -100), box(300, 100)]
    const routed = route([a, b, c], [net('n', a, b, c)]).get('n')!
    expect(routed.dots).toHaveLength(1)
    expectWay(wholeWay(routed, 'n 0'), output(a), input(b), [a, b, c])
    expectWay(wholeWay(routed, 'n 1'), output(a), input(c), [a, b, c])
  })

  test.each([1, 2, 3, 4])('finds ways between blocks that stand anywhere apart (seed %i)', (seed) => {
    const draw = random(seed)
    const blocks = Array.from({ length: 16 }, (_, k) =>
      box(160 * (k % 4) + Math.round(40 * draw()), 140 * Math.floor(k / 4) + Math.round(30 * draw())),
    )
    const nets = Array.from({ length: 8 }, (_, k) =>
      net(`n${k}`, blocks[k]!, blocks[8 + ((3 * k + seed) % 8)]!),
    )
    const routed = route(blocks, nets)
    const ways = nets.map(({ key }) => routed.get(key)!.paths.get(`${key} 0`)!)
    nets.forEach(({ source, targets }, k) => expectWay(ways[k]!, source, targets[0]!.end, blocks))
    for (const [k, way] of ways.entries())
      for (const other of ways.slice(k + 1))
        expect(overlap(way, other), 'no wire lies on another').toBe(false)
  })

  test('leaves wires alone that lie already', () => {
    const [a, b, c, d] = [box(0, 0), box(300, 0), box(0, 100), box(300, -100)]
    const blocks = [a, b, c, d]
    const first = route(blocks, [net('first', a, b)])
    const second = route(blocks, [net('second', c, d)], first)
    expect([...second.keys()]).toEqual(['second'])
    expectWay(second.get('second')!.paths.get('second 0')!, output(c), input(d), blocks)
  })
})

describe('a way that somebody has drawn', () => {
  const [from, to] = [output(box(0, 0)), input(box(300, 100))]

  test('runs along its bends, and is refused where it would not arrive in the direction of the port', () => {
    expect(bent(from, [150], to)).toEqual([
      [60, 20],
      [150, 20],
      [150, 120],
      [300, 120],
    ])
    expect(bent(from, [150, 60], to)).toBeNull()
    expect(bent(from, [], to)).toBeNull()
  })

  test('goes where its piece is dragged', () => {
    const way = bent(from, [150], to)!
    expect(dragged(way, 1, 220)).toEqual([220])
    const stepped = dragged(way, 0, 60)
    expect(bent(from, stepped, to)).toContainEqual([150, 60])
    const back = dragged(bent(from, stepped, to)!, 2, 20)
    expect(bent(from, back, to), 'dragged back, the step is not seen').toEqual(way)
  })
})
