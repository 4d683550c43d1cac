import { expect, test } from 'vitest'
import { freeBelow, freeInView, type Rectangle, shiftIntoView } from '../../src/model/free_place'

const view = { x: -100, y: 50, width: 600, height: 400 }
const size = { width: 60, height: 40 }
const areDisjoint = (a: Rectangle, b: Rectangle) =>
  a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y
const isInView = (a: Rectangle) =>
  a.x >= view.x &&
  a.y >= view.y &&
  a.x + a.width <= view.x + view.width &&
  a.y + a.height <= view.y + view.height

test('blocks that are added by name do not overlap, and are in view while there is room', () => {
  const blocks: Rectangle[] = []
  for (let k = 0; k < 40; k++) {
    const place = freeInView(size, view, blocks)
    for (const other of blocks) expect(areDisjoint(place, other)).toBe(true)
    if (k < 12) expect(isInView(place), `block ${k}`).toBe(true)
    blocks.push(place)
  }
  expect(blocks[0], 'the first is in the middle').toEqual({ ...size, x: 170, y: 230 })
})

test('a place beside the selected block is kept if it is free, otherwise the next one below is taken', () => {
  const preferred = { ...size, x: 0, y: 1.5 }
  expect(freeBelow(preferred, [])).toEqual(preferred)
  expect(freeBelow(preferred, [{ ...size, x: 10, y: 0 }])).toEqual({ ...preferred, y: 81.5 })
})

test('copies are shifted into view only if none of them is visible', () => {
  const view = { x: 1000, y: 500, width: 400, height: 300 }
  expect(
    shiftIntoView(
      [
        { x: 990, y: 520 },
        { x: 0, y: 0 },
      ],
      view,
      [],
      5,
    ),
  ).toBeNull()
  expect(shiftIntoView([{}], view, [], 5)).toBeNull()
  const copies = [
    { x: 3, y: -40 },
    { x: 103, y: 20 },
  ]
  const [dx, dy] = shiftIntoView(copies, view, [], 5)!
  expect([dx % 5, dy % 5]).toEqual([0, 0])
  for (const { x, y } of copies) {
    expect(x + dx).toBeGreaterThan(view.x)
    expect(x + dx + 70).toBeLessThan(view.x + view.width)
    expect(y + dy).toBeGreaterThan(view.y)
    expect(y + dy + 50).toBeLessThan(view.y + view.height)
  }
  const block = { x: 1150, y: 600, width: 100, height: 100 }
  const [ox, oy] = shiftIntoView([{ x: 0, y: 0 }], view, [block], 5)!
  expect(ox + 70 <= block.x || ox >= block.x + 100 || oy + 50 <= block.y || oy >= block.y + 100).toBe(true)
})
