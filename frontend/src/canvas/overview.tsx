import { MiniMap, useStore, type ReactFlowState } from '@xyflow/react'
import { useCallback, useMemo } from 'react'
import type { SheetBlock } from '../protocol'

/** A small map of the sheet, shown while part of the sheet is outside the window. */
export function Overview({ blocks }: { blocks: Record<string, SheetBlock> }) {
  const [left, top, right, bottom] = useMemo(() => {
    const all = Object.values(blocks)
    return [
      Math.min(...all.map(({ place }) => place.x)),
      Math.min(...all.map(({ place }) => place.y)),
      Math.max(...all.map(({ place, width }) => place.x + width)),
      Math.max(...all.map(({ place, height }) => place.y + height)),
    ]
  }, [blocks])
  const exceedsWindow = useCallback(
    ({ transform: [x, y, zoom], width, height }: ReactFlowState) =>
      left * zoom + x < 0 || top * zoom + y < 0 || right * zoom + x > width || bottom * zoom + y > height,
    [left, top, right, bottom],
  )
  return (
    useStore(exceedsWindow) && (
      <MiniMap pannable zoomable ariaLabel="Map of the sheet" style={{ width: 160, height: 110 }} />
    )
  )
}
