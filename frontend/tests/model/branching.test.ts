import { expect, test } from 'vitest'
import { nearestInput, nearestPointOn } from '../../src/model/branching'
import type { Point } from '../../src/model/wire_lines'
import { seeded } from './random'

test('the start of a branch is on the wire, and no other point of the wire is nearer', () => {
  const random = seeded(5)
  for (let round = 0; round < 200; round++) {
    const path: Point[] = [[400 * random(), 400 * random()]]
    for (let k = 0; k < 5; k++) {
      const [x, y] = path.at(-1)!
      path.push(k % 2 ? [x, 400 * random()] : [400 * random(), y])
    }
    const point: Point = [400 * random(), 400 * random()]
    const [x, y] = nearestPointOn(path, point)
    const onSegment = path
      .slice(1)
      .some(
        ([bx, by], k) =>
          Math.abs(
            Math.hypot(x - path[k]![0], y - path[k]![1]) +
              Math.hypot(bx - x, by - y) -
              Math.hypot(bx - path[k]![0], by - path[k]![1]),
          ) < 1e-9,
      )
    expect(onSegment).toBe(true)
    const distance = Math.hypot(x - point[0], y - point[1])
    for (let k = 1; k < path.length; k++)
      for (let part = 0; part <= 1; part += 0.1) {
        const [[ax, ay], [bx, by]] = [path[k - 1]!, path[k]!]
        const other = Math.hypot(ax + part * (bx - ax) - point[0], ay + part * (by - ay) - point[1])
        expect(distance).toBeLessThanOrEqual(other + 1e-9)
      }
  }
})

test('a branch ends at the nearest input within reach', () => {
  const block = (name: string, x: number) => ({
    name,
    place: { x, y: 0 },
    inputs: [5, 25].map((y, k) => ({
      name: `u${k + 1}`,
      x: 0,
      y,
      dx: 1,
      dy: 0,
      doc: '',
      label: '',
      unit: '',
    })),
  })
  const blocks = [block('A', 100), block('B', 130)]
  expect(nearestInput(blocks, [112, 6], 24)).toEqual({ port: 'A/u1', at: [100, 5] })
  expect(nearestInput(blocks, [117, 22], 24)).toEqual({ port: 'B/u2', at: [130, 25] })
  expect(nearestInput(blocks, [60, 5], 24)).toBeUndefined()
})
