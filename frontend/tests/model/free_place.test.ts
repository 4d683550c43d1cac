import { expect, test } from 'vitest'
import { freeBelow, freeInView, type Rectangle } from '../../src/model/free_place'

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
