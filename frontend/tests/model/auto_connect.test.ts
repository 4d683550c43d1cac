import { expect, test } from 'vitest'
import { proposedWire } from '../../src/model/auto_connect'
import type { SheetBlock, SheetPort, Wire } from '../../src/protocol'
import { seeded } from './random'

const port = (name: string, x: number, y: number, dx: number, dy: number, frame = false): SheetPort => ({
  name,
  doc: '',
  label: '',
  unit: '',
  x,
  y,
  dx,
  dy,
  ...(frame ? { frame } : {}),
})
const block = (name: string, x: number, y: number, inputs: SheetPort[], outputs: SheetPort[]) =>
  ({ name, place: { x, y }, width: 40, height: 40, inputs, outputs }) as unknown as SheetBlock
const gain = (name: string, x: number, y: number, flipped = false) =>
  block(
    name,
    x,
    y,
    [port('u', flipped ? 40 : 0, 20, flipped ? -1 : 1, 0)],
    [port('y', flipped ? 0 : 40, 20, flipped ? -1 : 1, 0)],
  )
/** A block with a frame port at its right (1) or left side (-1), as the server describes it in both lists. */
const framed = (name: string, x: number, y: number, outward: 1 | -1) => {
  const portX = outward > 0 ? 40 : 0
  return block(
    name,
    x,
    y,
    [port('b', portX, 20, -outward, 0, true)],
    [port('b', portX, 20, outward, 0, true)],
  )
}
const source = gain('source', 0, 0)
const at = (x: number, y: number, wires: Wire[] = [], others = [source]) =>
  proposedWire(gain('new', x, y), others, wires)?.wire

test('a block in front of a free port is connected with this port', () => {
  expect(at(80, 0)).toEqual({ source: 'source/y', target: 'new/u' })
  expect(at(80, 10)).toEqual({ source: 'source/y', target: 'new/u' })
  expect(at(-70, 0)).toEqual({ source: 'new/y', target: 'source/u' })
  for (const [x, y] of [
    [150, 0], // too far
    [80, 25], // not in front of the port
    [30, 0], // the input is behind the output
  ] as const)
    expect(at(x, y)).toBeUndefined()
  expect(proposedWire(gain('new', 80, 0, true), [source], [])).toBeUndefined()
})

test('connected ports and ports of the other kind are left alone; the nearest port is proposed', () => {
  expect(at(80, 0, [{ source: 'source/y', target: 'sink/u' }])).toBeUndefined()
  expect(at(80, 0, [{ source: 'other/y', target: 'new/u' }])).toBeUndefined()
  expect(at(80, 0, [], [framed('body', 0, 0, 1)])).toBeUndefined()
  expect(at(80, 0, [], [source, gain('sink', 130, 0)])).toEqual({ source: 'new/y', target: 'sink/u' })
  expect(at(80, 0, [], [source, gain('sink', 170, 0)])).toEqual({ source: 'source/y', target: 'new/u' })
})

test('frame ports are connected if they face each other', () => {
  const body = framed('body', 0, 0, 1)
  const proposed = (x: number, outward: 1 | -1) =>
    proposedWire(framed('joint', x, 0, outward), [body], [])?.wire
  expect([proposed(80, -1)!.source, proposed(80, -1)!.target].toSorted()).toEqual(['body/b', 'joint/b'])
  expect(proposed(80, 1)).toBeUndefined() // both ports at the right sides
  expect(proposed(-80, -1)).toBeUndefined() // the port is on the other side of the body
  expect(
    proposedWire(framed('joint', 80, 0, -1), [body], [{ source: 'x/b', target: 'body/b' }]),
  ).toBeUndefined()
  expect(
    proposedWire(framed('joint', 80, 0, -1), [body], [{ source: 'body/b', target: 'x/b' }]),
  ).toBeUndefined()
})

test('no wire is proposed through a third block', () => {
  const thin = { ...block('thin', 50, 0, [], []), width: 10 }
  expect(at(80, 0, [], [source, thin])).toBeUndefined()
  const above = { ...thin, place: { x: 50, y: -25 } }
  expect(at(80, 0, [], [source, above])).toEqual({ source: 'source/y', target: 'new/u' })
  // Behind the obstacle is a free port, in front of it another one.
  expect(at(80, 0, [], [source, thin, gain('sink', 160, 0)])).toEqual({ source: 'new/y', target: 'sink/u' })
})

test('a proposed wire is short, runs forwards, and has two unconnected ports, for random sheets', () => {
  const random = seeded(5)
  let proposals = 0
  for (let round = 0; round < 400; round++) {
    const blocks = Array.from({ length: 8 }, (_, k) =>
      gain(`b${k}`, random() * 300, random() * 200, random() < 0.3),
    )
    const wires = [0, 2, 4].map((k) => ({ source: `b${k}/y`, target: `b${k + 1}/u` }))
    const placed = { ...blocks[7]!, place: { x: random() * 300, y: random() * 200 } }
    const proposed = proposedWire(placed, blocks, wires)
    if (!proposed) continue
    proposals++
    const { wire, ends } = proposed
    const [from, to] = ends
    expect(wires.some(({ source, target }) => source === wire.source || target === wire.target)).toBe(false)
    expect([wire.source, wire.target].filter((ref) => ref.startsWith('b7/'))).toHaveLength(1)
    expect((to.x - from.x) * from.dx).toBeGreaterThan(0)
    expect(Math.abs(to.x - from.x)).toBeLessThanOrEqual(100)
    expect(Math.abs(to.y - from.y)).toBeLessThanOrEqual(20)
    expect(to.dx).toBe(-from.dx)
    for (const { name, place } of blocks.slice(0, 7)) {
      if ([wire.source, wire.target].some((ref) => ref.startsWith(`${name}/`))) continue
      const isBeside = Math.max(from.x, to.x) <= place.x || Math.min(from.x, to.x) >= place.x + 40
      const isAbove = Math.max(from.y, to.y) <= place.y || Math.min(from.y, to.y) >= place.y + 40
      expect(isBeside || isAbove).toBe(true)
    }
  }
  expect(proposals).toBeGreaterThan(20)
})
