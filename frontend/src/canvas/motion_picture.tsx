import { useReactFlow } from '@xyflow/react'
import { useEffect, useRef } from 'react'
import type { Rectangle } from '../model/free_place'
import { contains, intersection, pictureRegion, visiblePart, type View } from '../model/picture_region'
import { useStudio } from '../store'
import type { SheetNode } from './sheet_graph'
import type { SheetMotion } from './sheet_motion'
import { SheetPainter, type PlacedName, type PlacedValue, type SheetContent } from './sheet_picture'
import { nameScale } from './sheet_view'
import { shownName } from './signal_names'
import type { WireEdgeType } from './wire_edge'

/** Number of blocks above which a picture replaces the sheet during a motion. */
const MANY_BLOCKS = 150
/** Largest number of pixels of the picture. */
const MAX_PIXELS = 6e6
/** Magnifications of the picture beyond which it is drawn again. */
const [MIN_MAGNIFICATION, MAX_MAGNIFICATION] = [0.7, 1.4]
/** Distance of the names and marks of blocks from the blocks at the edge of the sheet, px. */
const AROUND = 200
/** Below this zoom the dots of the grid are not visible. */
const GRID_ZOOM = 0.5
/** Distance of the dots of the grid, px. */
const DOTS = 20

/**
 * A picture of a sheet with many blocks, shown while the sheet is panned or zoomed: the browser moves
 * it without looking at the thousands of elements of the sheet, which are hidden meanwhile.
 */
export function MotionPicture({ motion, bounds }: { motion: SheetMotion; bounds: Rectangle }) {
  const flow = useReactFlow<SheetNode, WireEdgeType>()
  const canvas = useRef<HTMLCanvasElement>(null)
  const grid = useRef<HTMLDivElement>(null)
  const isUsed = useStudio((s) => Object.keys(s.document?.blocks ?? {}).length > MANY_BLOCKS)
  useEffect(() => {
    if (!isUsed) return undefined
    const picture = new Picture(canvas.current!, grid.current!, bounds, () => ({
      nodes: flow.getNodes(),
      edges: flow.getEdges(),
      names: placedNames(),
      values: placedValues(),
    }))
    const stop = motion.onView(() => motion.isPictured && picture.show(motion.view, motion.count))
    motion.hasPicture = true
    return () => {
      stop()
      motion.hasPicture = false
    }
  }, [motion, flow, bounds, isUsed])
  return (
    <div className="motion-picture" aria-hidden>
      <div ref={grid} />
      <canvas ref={canvas} />
    </div>
  )
}

function placedNames(): PlacedName[] {
  return Object.values(useStudio.getState().document?.lines ?? {}).flatMap((net) => {
    const text = shownName(net)
    if (!net.name_at || !text) return []
    const [x, y, anchor] = net.name_at
    return [{ text, x, y, anchor, propagated: !net.name }]
  })
}

/** The displayed values, read from their elements without a layout, which the hidden sheet does not have. */
function placedValues(): PlacedValue[] {
  const values = document.querySelectorAll<HTMLElement>('.wire-values > [data-path]:not(:empty)')
  const scale = Number(values[0]?.parentElement?.style.getPropertyValue('--label-scale'))
  return Array.from(values, ({ textContent: text, style: { transform, width: fixedWidth } }) => {
    const [x = 0, y = 0] = transform.match(/-?[\d.]+/g)!.map(Number)
    if (!fixedWidth) return { text, x, y, align: transform.includes('-100%') ? 'right' : 'left', scale }
    const width = Number.parseFloat(fixedWidth)
    return { text, x: x + width, y: y - 5.5, align: 'right', scale, width }
  })
}

/** The picture on its canvas: drawn again where it does not show the visible part, or too coarsely. */
class Picture {
  private region: Rectangle = { x: 0, y: 0, width: 0, height: 0 }
  private zoom = 0
  /** The number of the motion for which the picture was drawn; the sheet may change between motions. */
  private drawnFor = -1
  private readonly painter = new SheetPainter()
  private readonly content: Rectangle

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly grid: HTMLElement,
    bounds: Rectangle,
    private readonly sheet: () => SheetContent,
  ) {
    this.content = {
      x: bounds.x - AROUND,
      y: bounds.y - AROUND,
      width: bounds.width + 2 * AROUND,
      height: bounds.height + 2 * AROUND,
    }
  }

  show(view: View, motionNumber: number): void {
    const panel = this.canvas.parentElement!
    const size: [number, number] = [panel.clientWidth, panel.clientHeight]
    const visible = intersection(visiblePart(view, size), this.content)
    const magnification = view.zoom / this.zoom
    const isCurrent =
      this.drawnFor === motionNumber &&
      magnification > MIN_MAGNIFICATION &&
      magnification < MAX_MAGNIFICATION &&
      contains(this.region, visible)
    if (!isCurrent) {
      this.draw(view, size)
      this.drawnFor = motionNumber
    }
    const shrink = view.zoom / (this.zoom * devicePixelRatio)
    const [left, top] = [view.x + view.zoom * this.region.x, view.y + view.zoom * this.region.y]
    // A shift by whole pixels does not blur the picture.
    const whole = (shift: number) =>
      view.zoom === this.zoom ? Math.round(shift * devicePixelRatio) / devicePixelRatio : shift
    this.canvas.style.transform = `translate(${whole(left)}px, ${whole(top)}px) scale(${shrink})`
    this.showGrid(view, size)
  }

  private draw(view: View, size: [number, number]): void {
    this.region = pictureRegion(view, size, this.content, devicePixelRatio, MAX_PIXELS)
    this.zoom = view.zoom
    const scale = view.zoom * devicePixelRatio
    this.canvas.width = Math.max(1, Math.ceil(this.region.width * scale))
    this.canvas.height = Math.max(1, Math.ceil(this.region.height * scale))
    // Software rendering: on a graphics processor, thousands of small shapes are slower.
    const context = this.canvas.getContext('2d', { willReadFrequently: true })
    if (!context) return
    const styles = getComputedStyle(this.canvas)
    const known = new Map<string, string>()
    const style = (name: string) => {
      let value = known.get(name)
      if (value === undefined) known.set(name, (value = styles.getPropertyValue(`--${name}`)))
      return value
    }
    this.painter.draw(context, this.sheet(), this.region, scale, nameScale(view.zoom), style)
  }

  /** The dots of the grid: one tile outside the panel at its upper left, so that a shift moves them. */
  private showGrid({ x, y, zoom }: View, [width, height]: [number, number]): void {
    const { style } = this.grid
    style.display = zoom < GRID_ZOOM ? 'none' : ''
    if (zoom < GRID_ZOOM) return
    const tile = DOTS * zoom
    const start = (shift: number) => (((shift % tile) + tile) % tile) - tile
    style.width = `${Math.ceil(width / GRID_ZOOM) + 2 * DOTS}px`
    style.height = `${Math.ceil(height / GRID_ZOOM) + 2 * DOTS}px`
    style.transform = `translate(${start(x)}px, ${start(y)}px) scale(${zoom})`
  }
}
