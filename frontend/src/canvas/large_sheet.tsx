import './large_sheet.css'
import { useComputedColorScheme } from '@mantine/core'
import { useReactFlow, useStore, ViewportPortal } from '@xyflow/react'
import { useContext, useEffect, useLayoutEffect, useMemo, useRef, useState } from 'react'
import type { Rectangle } from '../model/free_place'
import type { SheetBlock } from '../protocol'
import { useStudio } from '../store'
import { contains, visiblePart } from '../model/picture_region'
import { MotionPicture } from './motion_picture'
import { MotionContext, type SheetMotion } from './sheet_motion'

/** Distance of the dots of the grid, px. */
const DOTS = 20
/** Width of the grid around the blocks during a motion, px: a large window at the smallest zoom. */
const AROUND = 20_000
/** Width and height of the map, px. */
const WIDTH = 160
const HEIGHT = 110
/** Pixels of the canvas per CSS pixel. */
const PIXELS = 2
/** Time after the last change of a block until the map is drawn, ms: edits are not delayed. */
const DRAWING_DELAY_MS = 250
/** Distance of the blocks from the edge of the map, px. */
const MARGIN = 8
/** Zoom factor of the wheel: powers of two per px. */
const WHEEL_ZOOM = 0.002

interface OverviewProps {
  blocks: Record<string, SheetBlock>
  bounds: Rectangle
  motion: SheetMotion
}

/** The parts of a sheet that only large sheets have. */
export function LargeSheet() {
  const motion = useContext(MotionContext)!
  const blocks = useStudio((s) => s.document!.blocks)
  const bounds = useMemo(() => boundsOf(blocks), [blocks])
  return (
    <>
      <MovingGrid bounds={bounds} />
      <NoMultisampling />
      <MotionPicture {...{ motion, bounds }} />
      <Overview {...{ blocks, bounds, motion }} />
    </>
  )
}

/**
 * The grid during a motion, part of the layer that the browser moves. It also covers the gaps between the
 * blocks: otherwise the browser would divide the layer into thousands of layers, because their total area is
 * smaller.
 */
function MovingGrid({ bounds: { x, y, width, height } }: { bounds: Rectangle }) {
  const aligned = (coordinate: number) => DOTS * Math.floor(coordinate / DOTS) - AROUND
  return (
    <ViewportPortal>
      <div
        className="moving-grid"
        style={{
          left: aligned(x),
          top: aligned(y),
          width: width + 2 * AROUND,
          height: height + 2 * AROUND,
        }}
      >
        <NoMultisampling />
      </div>
    </ViewportPortal>
  )
}

/**
 * An almost transparent rectangle without anti-aliasing, for the layer that contains it. Chromium draws
 * layers with many paths by multisampling, unless a shape has no anti-aliasing. With multisampling, lines
 * thinner than a pixel have gaps, and drawing without a graphics processor takes several times as long.
 */
const NoMultisampling = () => (
  <svg className="no-multisampling" aria-hidden>
    <rect width="100%" height="100%" shapeRendering="crispEdges" />
  </svg>
)

/**
 * A map of the sheet, shown while part of the sheet is outside the window. A click centres the view, a drag
 * moves it, the wheel zooms.
 */
function Overview({ blocks, bounds, motion }: OverviewProps) {
  const [width, height] = [useStore((s) => s.width), useStore((s) => s.height)]
  const [shown, setShown] = useState(false)
  useLayoutEffect(() => {
    const update = () => setShown(!contains(visiblePart(motion.view, [width, height]), bounds))
    update()
    return motion.onView(update)
  }, [motion, bounds, width, height])
  return shown && <SheetMap {...{ blocks, bounds, motion }} panel={[width, height]} />
}

function SheetMap({
  blocks,
  bounds,
  motion,
  panel: [width, height],
}: OverviewProps & { panel: [number, number] }) {
  const flow = useReactFlow()
  const canvas = useRef<HTMLCanvasElement>(null)
  const scheme = useComputedColorScheme('light')
  const frame = useRef<HTMLDivElement>(null)
  const scale = Math.min((WIDTH - 2 * MARGIN) / bounds.width, (HEIGHT - 2 * MARGIN) / bounds.height)
  const left = WIDTH / 2 - scale * (bounds.x + bounds.width / 2)
  const top = HEIGHT / 2 - scale * (bounds.y + bounds.height / 2)
  useEffect(() => {
    const timer = setTimeout(() => {
      // Software rendering: on a graphics processor, thousands of small rectangles are slower.
      const context = canvas.current?.getContext('2d', { willReadFrequently: true })
      if (!context) return
      context.setTransform(PIXELS, 0, 0, PIXELS, 0, 0)
      context.clearRect(0, 0, WIDTH, HEIGHT)
      context.fillStyle = getComputedStyle(context.canvas).color
      for (const { place, width: w, height: h } of Object.values(blocks))
        context.fillRect(left + scale * place.x, top + scale * place.y, scale * w, scale * h)
    }, DRAWING_DELAY_MS)
    return () => clearTimeout(timer)
  }, [blocks, left, top, scale, scheme])
  useLayoutEffect(() => {
    const update = () => {
      const part = visiblePart(motion.view, [width, height])
      const { style } = frame.current!
      style.transform = `translate(${left + scale * part.x}px, ${top + scale * part.y}px)`
      style.width = `${scale * part.width}px`
      style.height = `${scale * part.height}px`
    }
    update()
    return motion.onView(update)
  }, [motion, width, height, left, top, scale])
  const centre = ({ currentTarget, clientX, clientY }: React.PointerEvent) => {
    const box = currentTarget.getBoundingClientRect()
    motion.begin()
    void flow.setCenter((clientX - box.x - left) / scale, (clientY - box.y - top) / scale, {
      zoom: motion.view.zoom,
    })
  }
  return (
    <div
      className="overview nowheel nopan"
      role="img"
      aria-label="Map of the sheet"
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId)
        centre(event)
      }}
      onPointerMove={(event) => event.buttons & 1 && centre(event)}
      onWheel={(event) => void flow.zoomTo(motion.view.zoom * 2 ** (-event.deltaY * WHEEL_ZOOM))}
    >
      <canvas ref={canvas} width={PIXELS * WIDTH} height={PIXELS * HEIGHT} />
      <div ref={frame} />
    </div>
  )
}

/** The rectangle around all blocks, px. */
function boundsOf(blocks: Record<string, SheetBlock>): Rectangle {
  let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity]
  for (const { place, width, height } of Object.values(blocks)) {
    left = Math.min(left, place.x)
    top = Math.min(top, place.y)
    right = Math.max(right, place.x + width)
    bottom = Math.max(bottom, place.y + height)
  }
  return { x: left, y: top, width: right - left, height: bottom - top }
}
