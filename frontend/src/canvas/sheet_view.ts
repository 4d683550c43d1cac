import { useStore, type ReactFlowInstance } from '@xyflow/react'
import { useEffect, useState, type RefObject } from 'react'
import type { Rectangle } from '../model/free_place'
import type { SheetBlock } from '../protocol'
import { partsToShow, viewports } from '../documents/document_views'
import { focusWhenShown } from '../sheet_focus'
import { useStudio } from '../store'
import type { SheetNode } from './sheet_graph'
import { sheetView } from './sheet_actions'
import { FIT } from './sheet_layout'
import { useSheetMotion } from './sheet_motion'
import type { WireEdgeType } from './wire_edge'

const LAYOUT_DELAY_MS = 120
/** Height of the name below a block, px. */
const NAME_HEIGHT = 18

type Sheet = RefObject<HTMLDivElement | null>
type Flow = ReactFlowInstance<SheetNode, WireEdgeType>

/** Centre and focus a block that was found by a search. */
export function useCentredBlock(flow: Flow, blocks: Record<string, SheetBlock>): void {
  const blockToCentre = useStudio((s) => s.blockToCentre)
  useEffect(() => {
    const block = blockToCentre === null ? undefined : blocks[blockToCentre]
    if (!block) return
    useStudio.setState({ blockToCentre: null })
    const { place, width, height } = block
    focusWhenShown(block.name, () => useStudio.getState().selection.has(block.name))
    // Executed after a newly opened sheet has been fitted into the window.
    setTimeout(
      () =>
        void flow.setCenter(place.x + width / 2, place.y + height / 2, {
          zoom: Math.max(flow.getZoom(), 0.8),
          duration: 150,
        }),
      2 * LAYOUT_DELAY_MS,
    )
  }, [blockToCentre, blocks, flow])
}

/** Distance from the edge of the panel within which a new block is moved farther into view, px. */
const MARGIN = 24

/** Move the view, without zooming, so that all of a block is visible. */
function revealBlock(
  flow: Pick<Flow, 'getViewport' | 'setViewport'>,
  panel: { width: number; height: number },
  block: Rectangle,
): void {
  const { x, y, zoom } = flow.getViewport()
  const shift = (start: number, size: number, available: number) => {
    const [low, high] = [start - MARGIN, start + size + MARGIN - available]
    return low < 0 ? -low : Math.min(0, -Math.min(high, low))
  }
  const dx = shift(block.x * zoom + x, block.width * zoom, panel.width)
  const dy = shift(block.y * zoom + y, (block.height + NAME_HEIGHT) * zoom, panel.height)
  if (dx || dy) void flow.setViewport({ x: x + dx, y: y + dy, zoom }, { duration: 150 })
}

/**
 * The sheet is fitted to its panel, at every panel size, until the user moves it. The moved view is stored
 * under the key of the sheet, and shown when the sheet is shown again.
 */
function useFitView(sheet: Sheet, flow: Flow, key: string): void {
  useEffect(() => {
    const element = sheet.current
    if (!element) return
    const isMoved = () => viewports.has(key)
    const store = () => isMoved() && viewports.set(key, flow.getViewport())
    addEventListener('pagehide', store, true)
    const leave = () => {
      store()
      removeEventListener('pagehide', store, true)
    }
    if (isMoved()) return leave
    let timer = 0
    const observer = new ResizeObserver(() => {
      clearTimeout(timer)
      // React Flow would fit an empty sheet to the first block that is dropped on it, which would then jump.
      timer = window.setTimeout(() => {
        if (!isMoved() && flow.getNodes().length) void flow.fitView(FIT)
      }, LAYOUT_DELAY_MS)
    })
    const stop = () => {
      clearTimeout(timer)
      observer.disconnect()
    }
    const move = () => {
      viewports.set(key, flow.getViewport())
      stop()
    }
    observer.observe(element)
    for (const kind of ['pointerdown', 'wheel', 'keydown', 'drop'])
      element.addEventListener(kind, move, { once: true })
    return () => {
      stop()
      leave()
    }
  }, [sheet, flow, key])
}

/** The stored view of a sheet, else the view of all blocks. */
function useInitialView(key: string, empty: boolean) {
  const [view] = useState(() => {
    const defaultViewport = viewports.get(key)
    // An empty sheet would be fitted to the first block that is dropped on it, which would then jump.
    return { defaultViewport, fitView: !defaultViewport && !empty && !partsToShow.has(key) }
  })
  return view
}

/** Scale of block names: larger on a sheet that is zoomed out, because there is room below the blocks. */
export function nameScale(zoom: number): number {
  const scale = Math.min(Math.max(0.9 / zoom, 1), 1.25)
  return Math.round(20 * scale) / 20
}

/** Set the size of the names for the present zoom. */
function useNameScale(sheet: Sheet): void {
  const scale = useStore((s) => nameScale(s.transform[2]))
  useEffect(() => sheet.current?.style.setProperty('--name-scale', String(scale)), [sheet, scale])
}

/** The commands of the visible sheet act on this view. */
function useSheetView(sheet: Sheet, flow: Flow, key: string): void {
  useEffect(() => {
    // After this the sheet is not fitted into its panel any more.
    const keepView = () => viewports.set(key, flow.getViewport())
    sheetView.zoom = (factor) => {
      keepView()
      void flow.zoomTo(factor === null ? 1 : factor * flow.getZoom(), { duration: 120 })
    }
    sheetView.fit = () => void flow.fitView({ ...FIT, duration: 150 })
    sheetView.visible = () => {
      const { clientWidth: width, clientHeight: height } = sheet.current!
      const { x, y, zoom } = flow.getViewport()
      return { x: -x / zoom, y: -y / zoom, width: width / zoom, height: height / zoom }
    }
    sheetView.reveal = (block) => {
      const { clientWidth: width, clientHeight: height } = sheet.current!
      revealBlock(flow, { width, height }, block)
    }
    const show = (part: Rectangle, duration?: number) => {
      keepView()
      void flow.fitBounds(part, { padding: 0, duration })
    }
    sheetView.show = (part) => show(part, 150)
    const part = partsToShow.get(key)
    if (part && partsToShow.delete(key)) show(part)
    return () => {
      sheetView.show = null
      sheetView.fit = null
      sheetView.zoom = null
      sheetView.visible = null
      sheetView.reveal = null
    }
  }, [flow, sheet, key])
}

/** The view of the visible sheet: its commands, its motion, and the properties that React Flow receives. */
export function useView(
  sheet: Sheet,
  flow: Flow,
  key: string,
  blocks: Record<string, SheetBlock>,
  empty: boolean,
) {
  const initialView = useInitialView(key, empty)
  // Ends a motion before the other hooks store the view.
  const motion = useSheetMotion(sheet, Object.keys(blocks).length, initialView.defaultViewport)
  useSheetView(sheet, flow, key)
  useNameScale(sheet)
  useFitView(sheet, flow, key)
  return { motion, view: { ...initialView, viewport: motion.view, onViewportChange: motion.change } }
}
