import type { Rectangle } from './free_place'

/** The shift (px) and magnification of a sheet. */
export interface View {
  x: number
  y: number
  zoom: number
}

/** The margins around the visible part that a picture may have, in sizes of the panel. */
const MARGINS = [3, 1.5, 0.75, 0.3, 0.1]

/** The visible part of a sheet, with a margin in sizes of the panel. */
export function visiblePart({ x, y, zoom }: View, [width, height]: [number, number], margin = 0): Rectangle {
  return {
    x: (-x - margin * width) / zoom,
    y: (-y - margin * height) / zoom,
    width: ((1 + 2 * margin) * width) / zoom,
    height: ((1 + 2 * margin) * height) / zoom,
  }
}

/** The common part of two rectangles; without one, the size is not positive. */
export function intersection(a: Rectangle, b: Rectangle): Rectangle {
  const [x, y] = [Math.max(a.x, b.x), Math.max(a.y, b.y)]
  const right = Math.min(a.x + a.width, b.x + b.width)
  const bottom = Math.min(a.y + a.height, b.y + b.height)
  return { x, y, width: right - x, height: bottom - y }
}

/** Whether a rectangle contains another one; rectangles without an area are contained in all others. */
export const contains = (outer: Rectangle, inner: Rectangle): boolean =>
  inner.width <= 0 ||
  inner.height <= 0 ||
  (outer.x <= inner.x &&
    outer.y <= inner.y &&
    outer.x + outer.width >= inner.x + inner.width &&
    outer.y + outer.height >= inner.y + inner.height)

/**
 * The part of the sheet that a picture shows: the visible part with the widest margin for which it has at
 * most `maxPixels` pixels, without the empty surroundings of `content`.
 */
export function pictureRegion(
  view: View,
  panel: [number, number],
  content: Rectangle,
  pixelsPerPx: number,
  maxPixels: number,
): Rectangle {
  const regions = MARGINS.map((margin) => intersection(visiblePart(view, panel, margin), content))
  const pixels = ({ width, height }: Rectangle) => width * height * (view.zoom * pixelsPerPx) ** 2
  return regions.find((region) => pixels(region) <= maxPixels) ?? regions.at(-1)!
}
