import { Position, type FitViewOptions } from '@xyflow/react'
import type { PortSpot, SheetBlock } from '../protocol'

const NAME_SIZE = 11
const NAME_FONT = `${NAME_SIZE}px 'Inter Variable', sans-serif`
/** Maximum width of a name, px; longer names are cut. */
export const WIDEST_NAME = 168
/** Width and height of a port, px. */
export const PORT = 9

/** The side of a block at which a port is. */
export function side({ dx, dy }: PortSpot, output: boolean): Position {
  const [x, y] = output ? [dx, dy] : [-dx, -dy]
  return x > 0 ? Position.Right : x < 0 ? Position.Left : y > 0 ? Position.Bottom : Position.Top
}

let ruler: CanvasRenderingContext2D | null | undefined
const widths = new Map<string, number>()

/** Width of a block's name, px. */
export function nameWidth(name: string): number {
  const known = widths.get(name)
  if (known !== undefined) return known
  ruler ??= document.createElement('canvas').getContext('2d')
  if (!ruler) return 6 * name.length
  ruler.font = NAME_FONT
  const width = Math.min(ruler.measureText(name).width, WIDEST_NAME)
  // Before the page's font is loaded, a fallback font is measured.
  if (document.fonts.check(NAME_FONT)) widths.set(name, width)
  return width
}

/** The side of a block for its name: one without wires, as in the drawings of reports. */
export function nameSide({ place, inputs, height }: SheetBlock): 'below' | 'beside' | 'above' {
  if ((place.rotation ?? 0) % 180 !== 0) return 'beside' // signals run from top to bottom
  return inputs.some(({ y }) => y >= height) ? 'above' : 'below' // wires enter a round sum from below
}

/**
 * Padding with which the sheet is fitted into its panel: no part of it is under the buttons at the left, and
 * the lowest names are visible.
 */
export const FIT: FitViewOptions = {
  padding: { top: '16px', right: '24px', bottom: '32px', left: '56px' },
  maxZoom: 1.25,
}
