import { expect, test } from 'vitest'
import { freePort } from '../../src/model/free_port'
import { resized, type Corner } from '../../src/model/resizing'
import type { SheetBlock } from '../../src/protocol'

test.each<Corner>([
  [-1, -1],
  [1, -1],
  [-1, 1],
  [1, 1],
])('a block resized at the corner %i, %i keeps its opposite corner and its smallest size', (right, down) => {
  const box = { x: 13, y: 7, width: 60, height: 40 }
  for (const by of [
    { x: 31, y: -12 },
    { x: -300, y: -300 },
    { x: 300, y: 300 },
  ]) {
    const result = resized(box, [right, down], by, 3)
    expect(right < 0 ? result.x + result.width : result.x).toBe(right < 0 ? box.x + box.width : box.x)
    expect(down < 0 ? result.y + result.height : result.y).toBe(down < 0 ? box.y + box.height : box.y)
    expect([result.width % 5, result.height % 5]).toEqual([0, 0])
    expect(result.width).toBeGreaterThanOrEqual(20)
    expect(result.height).toBeGreaterThanOrEqual(30)
  }
})

test('a wire that is dropped on a block takes the first free input, or the first output', () => {
  const spots = (names: string) => names.split('').map((name) => ({ name }))
  const block = { name: 'Sum', inputs: spots('abc'), outputs: spots('yz') } as SheetBlock
  const wires = ['Sum/a', 'Sum/b'].map((target) => ({ source: 'x/y', target }))
  expect(freePort(block, true, [])).toBe('Sum/a')
  expect(freePort(block, true, wires)).toBe('Sum/c')
  expect(freePort(block, true, [...wires, { source: 'x/y', target: 'Sum/c' }])).toBeUndefined()
  expect(freePort(block, false, wires)).toBe('Sum/y')
})
