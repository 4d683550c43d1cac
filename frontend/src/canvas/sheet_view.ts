import type { ReactFlowInstance } from '@xyflow/react'
import { useEffect, type RefObject } from 'react'
import type { SheetBlock } from '../protocol'
import { useStudio } from '../store'
import type { SheetNode } from './sheet_graph'
import { FIT } from './sheet_layout'
import type { WireEdgeType } from './wire_edge'

const SETTLE_MS = 120

type Sheet = RefObject<HTMLDivElement | null>
type Flow = ReactFlowInstance<SheetNode, WireEdgeType>

/** Centre and focus a block that was found by a search. */
export function useSought(sheet: Sheet, flow: Flow, blocks: Record<string, SheetBlock>): void {
  const sought = useStudio((s) => s.sought)
  useEffect(() => {
    const block = sought === null ? undefined : blocks[sought]
    if (!block) return
    useStudio.setState({ sought: null })
    const { place, width, height } = block
    // Executed after a newly opened sheet has been fitted into the window.
    setTimeout(() => {
      void flow.setCenter(place.x + width / 2, place.y + height / 2, {
        zoom: Math.max(flow.getZoom(), 0.8),
        duration: 150,
      })
      sheet.current
        ?.querySelector<HTMLElement>(`.react-flow__node[data-id="${CSS.escape(block.name)}"]`)
        ?.focus({ preventScroll: true })
    }, 2 * SETTLE_MS)
  }, [sheet, sought, blocks, flow])
}

/** The sheet is fitted to its panel, at every panel size, until the user moves it. */
export function useFitted(sheet: Sheet, flow: Flow): void {
  useEffect(() => {
    const element = sheet.current
    if (!element) return
    let timer = 0
    const sized = new ResizeObserver(() => {
      clearTimeout(timer)
      timer = window.setTimeout(() => void flow.fitView(FIT), SETTLE_MS)
    })
    const leave = () => {
      clearTimeout(timer)
      sized.disconnect()
    }
    sized.observe(element)
    for (const kind of ['pointerdown', 'wheel', 'keydown'])
      element.addEventListener(kind, leave, { once: true })
    return leave
  }, [sheet, flow])
}
