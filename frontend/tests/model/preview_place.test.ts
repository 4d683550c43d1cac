import { describe, expect, it } from 'vitest'
import { previewPlace, previewSize } from '../../src/model/preview_place'

const FRAME = { width: 1000, height: 600 }
const SIZE = { width: 300, height: 200 }
const blockAt = (x: number, y: number) => ({ x, y, width: 60, height: 40 })

describe('the preview of a subsystem', () => {
  it('is below the block', () => {
    expect(previewPlace(blockAt(400, 100), SIZE, FRAME)).toEqual({ left: 280, top: 150 })
  })
  it('is above a block at the lower edge', () => {
    expect(previewPlace(blockAt(400, 500), SIZE, FRAME)).toEqual({ left: 280, top: 290 })
  })
  it('is beside a block in a low window', () => {
    expect(previewPlace(blockAt(400, 100), SIZE, { width: 1000, height: 250 }).left).toBe(470)
    expect(previewPlace(blockAt(800, 100), SIZE, { width: 1000, height: 250 }).left).toBe(490)
  })
  it('never covers the block and stays in the window', () => {
    for (let x = 0; x <= 940; x += 47)
      for (let y = 0; y <= 560; y += 40) {
        const { left, top } = previewPlace(blockAt(x, y), SIZE, FRAME)
        const covers = left < x + 60 && left + 300 > x && top < y + 40 && top + 200 > y
        expect(covers).toBe(false)
        expect(left >= 0 && left + 300 <= 1000 && top >= 0 && top + 200 <= 600).toBe(true)
      }
  })
  it('has the shape of its picture and is not enlarged', () => {
    expect(previewSize({ width: 800, height: 200 }, { width: 400, height: 300 })).toEqual({
      width: 400,
      height: 100,
    })
    expect(previewSize({ width: 100, height: 50 }, { width: 400, height: 300 })).toEqual({
      width: 100,
      height: 50,
    })
  })
})
