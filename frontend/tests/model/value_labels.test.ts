import { expect, test } from 'vitest'
import type { Rectangle } from '../../src/model/free_place'
import { fittedValue, labelWidth, placeLabels, type ValueLabel } from '../../src/model/value_labels'
import { seeded } from './random'

const overlap = (a: Rectangle, b: Rectangle) =>
  Math.min(a.x + a.width, b.x + b.width) - Math.max(a.x, b.x) > 1e-9 &&
  Math.min(a.y + a.height, b.y + b.height) - Math.max(a.y, b.y) > 1e-9

test('a label covers no block, no name and no other label, for random positions', () => {
  const random = seeded(7)
  for (let round = 0; round < 200; round++) {
    const obstacles: Rectangle[] = Array.from({ length: 12 }, () => ({
      x: random() * 600,
      y: random() * 300,
      width: 10 + random() * 90,
      height: 10 + random() * 60,
    }))
    const labels = Array.from({ length: 6 }, (): ValueLabel => {
      const [x, y, mx, my] = [random() * 600, random() * 300, random() * 600, random() * 300]
      const path = [
        [x, y],
        [mx, y],
        [mx, my],
        [random() * 600, my],
      ] as const
      return { x, y, direction: mx > x ? 1 : -1, paths: [path], width: labelWidth(round % 4) }
    })
    const height = 14 + random() * 21
    const placed = placeLabels(labels, { height, scale: height / 14 }, obstacles)
    const drawn = placed.map(({ x, top, direction, width }) => ({
      x: direction > 0 ? x : x - width,
      y: top,
      width,
      height,
    }))
    drawn.forEach((label, k) => {
      for (const other of [...obstacles, ...drawn.slice(0, k)]) expect(overlap(label, other)).toBe(false)
    })
  }
})

const label: ValueLabel = { x: 0, y: 0, direction: 1, paths: [], width: labelWidth(1) }
const size = { height: 14, scale: 1 }

test('a label is above its wire, else below, else beside a segment with room', () => {
  expect(placeLabels([label], size, [])).toEqual([{ x: 6, top: -18, direction: 1, width: labelWidth(1) }])
  const above: Rectangle = { x: 30, y: -20, width: 50, height: 18 }
  expect(placeLabels([label], size, [above])).toMatchObject([{ x: 6, top: 4 }])
  const both = [above, { ...above, x: 20, y: 2 }]
  expect(placeLabels([label], size, both)).toMatchObject([{ top: -18, width: 24 }])
  const path = [
    [0, 0],
    [15, 0],
    [15, 100],
    [400, 100],
  ] as const
  const [beside] = placeLabels([{ ...label, paths: [path] }], size, both)
  expect(beside).toEqual({ x: 19, top: 43, direction: 1, width: labelWidth(1) })
  // Values of several outputs at one place are below one another or elsewhere.
  const [first, second] = placeLabels([label, label], size, [])
  expect([first!.top, second!.top]).toEqual([-18, 4])
})

test('a value has fewer digits where there is little room, and no number is ever cut off', () => {
  const text = (digits: number) => `${(-2.449e-15).toExponential(digits - 1)} m`
  expect([120, 70, 40].map((width) => fittedValue(text, width))).toEqual(['-2.449e-15 m', '-2.4e-15 m', '…'])
  const vector = (digits: number, elements: number) =>
    `[${[1.2345, 2.3456, 3.4567]
      .slice(0, elements)
      .map((value) => value.toPrecision(digits))
      .join(', ')}${elements < 3 ? ', …' : ''}]`
  expect([200, 120, 90, 60, 20].map((width) => fittedValue(vector, width, 3))).toEqual([
    '[1.234, 2.346, 3.457]',
    '[1.23, 2.35, 3.46]',
    '[1.2, 2.3, …]',
    '[1.2, …]',
    '…',
  ])
})
