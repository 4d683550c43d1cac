import { useReactFlow } from '@xyflow/react'
import { useState } from 'react'
import { resized, type Corner } from '../model/resizing'
import type { SheetBlock } from '../protocol'
import { change, useStudio } from '../store'
import { onEscape } from './pointer_drag'

const CORNERS: Corner[] = [
  [-1, -1],
  [1, -1],
  [-1, 1],
  [1, 1],
]

/** Handles at the corners of a block that is selected alone. */
export function ResizeHandles({ block }: { block: SheetBlock }) {
  const alone = useStudio((s) => s.selection.size === 1)
  const flow = useReactFlow()
  const [size, setSize] = useState<ReturnType<typeof resized> | null>(null)
  if (!alone) return null
  const { place, width, height } = block
  const original = { x: place.x, y: place.y, width, height }
  const startResize = (corner: Corner) => (event: React.PointerEvent<HTMLDivElement>) => {
    if (event.button !== 0) return
    event.stopPropagation()
    const [x, y] = [event.clientX, event.clientY]
    const handle = event.currentTarget
    handle.setPointerCapture(event.pointerId)
    let rectangle = original
    const ports = Math.max(block.inputs.length, block.outputs.length)
    handle.onpointermove = (move) => {
      const zoom = flow.getZoom()
      rectangle = resized(
        original,
        corner,
        { x: (move.clientX - x) / zoom, y: (move.clientY - y) / zoom },
        ports,
      )
      setSize(rectangle)
    }
    const escape = new AbortController()
    const end = (apply: boolean) => () => {
      escape.abort()
      handle.onpointermove = handle.onpointerup = handle.onpointercancel = null
      setSize(null)
      if (apply && (rectangle.width !== width || rectangle.height !== height))
        void change({ kind: 'move', places: { [block.name]: { ...place, ...rectangle } } })
    }
    handle.onpointerup = end(true)
    handle.onpointercancel = end(false)
    onEscape(end(false), escape.signal)
  }
  return (
    <>
      {CORNERS.map((corner) => (
        <div
          key={corner.join()}
          className="resize nodrag nopan"
          style={{
            left: corner[0] < 0 ? -5 : width - 3,
            top: corner[1] < 0 ? -5 : height - 3,
            cursor: corner[0] === corner[1] ? 'nwse-resize' : 'nesw-resize',
          }}
          onPointerDown={startResize(corner)}
        />
      ))}
      {size && (
        <div
          className="resized"
          style={{ left: size.x - place.x, top: size.y - place.y, width: size.width, height: size.height }}
        />
      )}
    </>
  )
}
