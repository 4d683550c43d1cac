import { expect, test } from 'vitest'
import { contains, pictureRegion, visiblePart } from '../../src/model/picture_region'
import { seeded } from './random'

test('a picture contains what is visible of the sheet, and is not larger than allowed', () => {
  const random = seeded(5)
  const between = (low: number, high: number) => low + (high - low) * random()
  for (let k = 0; k < 500; k++) {
    const view = { x: between(-5e3, 5e3), y: between(-5e3, 5e3), zoom: between(0.1, 4) }
    const panel: [number, number] = [between(200, 2500), between(100, 1300)]
    const content = {
      x: between(-1e4, 0),
      y: between(-1e4, 0),
      width: between(10, 2e4),
      height: between(10, 2e4),
    }
    const visible = visiblePart(view, panel)
    const region = pictureRegion(view, panel, content, 1, 8e6)
    const shown = {
      x: Math.max(visible.x, content.x),
      y: Math.max(visible.y, content.y),
      width: Math.min(visible.x + visible.width, content.x + content.width) - Math.max(visible.x, content.x),
      height:
        Math.min(visible.y + visible.height, content.y + content.height) - Math.max(visible.y, content.y),
    }
    expect(contains(region, shown)).toBe(true)
    if (region.width > 0 && region.height > 0)
      expect(region.width * region.height * view.zoom ** 2).toBeLessThanOrEqual(8e6)
  }
})

test('a small sheet is in the picture as a whole', () => {
  const content = { x: 0, y: 0, width: 4000, height: 4000 }
  expect(pictureRegion({ x: 300, y: 10, zoom: 0.1 }, [900, 430], content, 1, 8e6)).toEqual(content)
})
