import { Position, type FitViewOptions } from '@xyflow/react'
import type { Rectangle } from '../model/free_place'
import type { SheetPort, SheetBlock } from '../protocol'

const NAME_SIZE = 11
const NAME_FONT = `${NAME_SIZE}px 'Inter Variable', sans-serif`
/** Maximum width of a name, px; longer names are truncated. */
export const MAX_NAME_WIDTH = 168
/** Width and height of a port, px. */
export const PORT = 9

/** The side of a block at which a port is. */
export function portSide({ dx, dy }: SheetPort, output: boolean): Position {
  const [x, y] = output ? [dx, dy] : [-dx, -dy]
  return x > 0 ? Position.Right : x < 0 ? Position.Left : y > 0 ? Position.Bottom : Position.Top
}

/** The sides of a block with ports. */
export const portSides = ({ inputs, outputs }: SheetBlock): Set<string> =>
  new Set(
    [...inputs.map((port) => portSide(port, false)), ...outputs.map((port) => portSide(port, true))].map(
      (position) => (position === Position.Top ? 'above' : position === Position.Bottom ? 'below' : position),
    ),
  )

let measuringContext: CanvasRenderingContext2D | null | undefined
const widths = new Map<string, number>()

/** Width of a block's name, px. */
export function nameWidth(name: string): number {
  const cached = widths.get(name)
  if (cached !== undefined) return cached
  measuringContext ??= document.createElement('canvas').getContext('2d')
  if (!measuringContext) return 6 * name.length
  measuringContext.font = NAME_FONT
  const width = Math.min(measuringContext.measureText(name).width, MAX_NAME_WIDTH)
  // Before the font of the front end is loaded, a fallback font is measured.
  if (document.fonts.check(NAME_FONT)) widths.set(name, width)
  return width
}

/** The area of a block's name, if it is visible. */
export function nameArea({ name, shown_name_side: side, place, width, height }: SheetBlock): Rectangle[] {
  const { x, y } = place
  if (side === 'hidden') return []
  const textWidth = nameWidth(name)
  const middle = { x: x + (width - textWidth) / 2, y: y + height / 2 - 7 }
  const corner = {
    below: { x: middle.x, y: y + height + 2 },
    above: { x: middle.x, y: y - 16 },
    left: { x: x - 5 - textWidth, y: middle.y },
    right: { x: x + width + 5, y: middle.y },
    corner: { x: x + 0.78 * width, y: y - 15 },
  }[side]
  return [{ ...corner, width: textWidth, height: 14 }]
}

/**
 * Padding with which the sheet is fitted into its panel: no part of it is under the buttons at the left, and
 * the lowest names are visible.
 */
export const FIT: FitViewOptions = {
  padding: { top: '16px', right: '24px', bottom: '32px', left: '56px' },
  maxZoom: 1.25,
}
