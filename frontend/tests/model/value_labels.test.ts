import { expect, test } from 'vitest'
import type { Rectangle } from '../../src/model/free_place'
import { fittedValue, labelPosition, WIRE_DISTANCE } from '../../src/model/value_labels'

let seed = 7
const random = (limit: number) => ((seed = (seed * 48271) % 2147483647) / 2147483647) * limit

test('a label covers no block and no name, for random positions', () => {
  for (let round = 0; round < 300; round++) {
    const obstacles: Rectangle[] = Array.from({ length: 12 }, () => ({
      x: random(600),
      y: random(300),
      width: 10 + random(90),
      height: 10 + random(60),
    }))
    const point = { x: random(600), y: random(300) }
    const direction = round % 2 ? 1 : -1
    const height = 14 + random(21)
    const { below, width } = labelPosition(point, direction, { height }, obstacles)
    const label = {
      x: direction > 0 ? point.x : point.x - width,
      y: below ? point.y + WIRE_DISTANCE : point.y - WIRE_DISTANCE - height,
      width,
      height,
    }
    for (const obstacle of obstacles) {
      const across = Math.min(label.x + width, obstacle.x + obstacle.width) - Math.max(label.x, obstacle.x)
      const down = Math.min(label.y + height, obstacle.y + obstacle.height) - Math.max(label.y, obstacle.y)
      expect(across > 1e-9 && down > 1e-9).toBe(false)
    }
  }
})

test('a label is above its wire unless there is more room below', () => {
  const above: Rectangle = { x: 30, y: -20, width: 50, height: 18 }
  expect(labelPosition({ x: 0, y: 0 }, 1, { height: 14 }, [])).toMatchObject({ below: false })
  expect(labelPosition({ x: 0, y: 0 }, 1, { height: 14 }, [above])).toMatchObject({ below: true })
  const both = [above, { ...above, x: 20, y: 2 }]
  expect(labelPosition({ x: 0, y: 0 }, 1, { height: 14 }, both)).toEqual({ below: false, width: 30 })
})

test('a value has fewer digits where there is little room, and is never cut off', () => {
  const text = (digits: number) => `${(-2.449e-15).toExponential(digits - 1)} m`
  expect([120, 70, 40].map((width) => fittedValue(text, width))).toEqual(['-2.449e-15 m', '-2.4e-15 m', '…'])
  expect(fittedValue((digits) => `[${(0.5).toFixed(digits)}, …]`, 30)).toBe('[0.5000, …]')
})
