import type uPlot from 'uplot'
import { useCursor } from '../run/cursor'
import { pan, shownWindow, useWindow, zoomBy } from './window'

const GRIP_PX = 6
export const CLICK_PX = 3
export type Values = [low: number, high: number]

/** The measuring cursor under the pointer. */
export function gripOf(plot: uPlot, event: MouseEvent): 0 | 1 | null {
  const { cursors } = useWindow.getState()
  if (!cursors) return null
  const x = event.clientX - plot.over.getBoundingClientRect().left
  const far = cursors.map((time) => Math.abs(plot.valToPos(time, 'x') - x))
  const nearest = far[0]! <= far[1]! ? 0 : 1
  return far[nearest]! <= GRIP_PX ? nearest : null
}

/** The wheel zooms, Shift or the middle button pans, a click selects a time, cursors are dragged. */
export function listen(plot: uPlot): () => void {
  const { over } = plot
  const timeOf = (event: MouseEvent) => plot.posToVal(event.clientX - over.getBoundingClientRect().left, 'x')
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const [from, to] = shownWindow()
    if (event.shiftKey || event.deltaX) pan(((to - from) * (event.deltaX || event.deltaY)) / over.clientWidth)
    else zoomBy(event.deltaY > 0 ? 1.25 : 0.8, timeOf(event))
  }
  const down = (event: PointerEvent) => {
    if (event.button === 2) return
    const grip = gripOf(plot, event)
    const panning = event.button === 1 || event.shiftKey
    const from = event.clientX
    let last = event.clientX
    const move = (moved: PointerEvent) => {
      const { cursors } = useWindow.getState()
      if (grip !== null && cursors) {
        const [first, end] = shownWindow()
        const time = Math.min(Math.max(timeOf(moved), first), end)
        useWindow.setState({ cursors: grip ? [cursors[0], time] : [time, cursors[1]] })
      } else if (panning) {
        const [first, end] = shownWindow()
        pan(((end - first) * (last - moved.clientX)) / over.clientWidth)
        last = moved.clientX
      }
    }
    const up = (ended: PointerEvent) => {
      removeEventListener('pointermove', move)
      removeEventListener('pointerup', up)
      if (grip === null && !panning && Math.abs(ended.clientX - from) < CLICK_PX)
        useCursor.setState({ time: Math.max(timeOf(ended), 0), playing: false })
    }
    if (panning || grip !== null) event.preventDefault()
    addEventListener('pointermove', move)
    addEventListener('pointerup', up)
  }
  const hover = (event: PointerEvent) => {
    over.style.cursor = gripOf(plot, event) === null ? '' : 'ew-resize'
  }
  over.addEventListener('wheel', wheel, { passive: false })
  over.addEventListener('pointerdown', down)
  over.addEventListener('pointermove', hover)
  return () => {
    over.removeEventListener('wheel', wheel)
    over.removeEventListener('pointerdown', down)
    over.removeEventListener('pointermove', hover)
  }
}

const ZOOM = 1.25

/**
 * On the value axis the wheel zooms about the pointer, dragging pans, and a double click shows all values.
 */
export function listenAtValues(plot: uPlot, show: (values: Values | null) => void): () => void {
  const axis = plot.root.querySelectorAll<HTMLElement>('.u-axis')[1]
  if (!axis) return () => {}
  axis.classList.add('values-axis')
  axis.title = 'Wheel: zoom the values. Drag: move them. Double click: show all.'
  const seen = (): Values => [plot.scales['y']?.min ?? 0, plot.scales['y']?.max ?? 1]
  const valueOf = (event: MouseEvent) =>
    plot.posToVal(event.clientY - plot.over.getBoundingClientRect().top, 'y')
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const by = event.deltaY > 0 ? ZOOM : 1 / ZOOM
    const about = valueOf(event)
    show(seen().map((end) => about + by * (end - about)) as Values)
  }
  const down = (event: PointerEvent) => {
    if (event.button !== 0) return
    const begun = seen()
    const start = event.clientY
    axis.setPointerCapture(event.pointerId)
    const move = (moved: PointerEvent) => {
      const by = ((moved.clientY - start) / plot.over.clientHeight) * (begun[1] - begun[0])
      if (Math.abs(moved.clientY - start) >= CLICK_PX) show([begun[0] + by, begun[1] + by])
    }
    const up = () => {
      axis.removeEventListener('pointermove', move)
      axis.removeEventListener('pointerup', up)
    }
    axis.addEventListener('pointermove', move)
    axis.addEventListener('pointerup', up)
  }
  const all = () => show(null)
  axis.addEventListener('wheel', wheel, { passive: false })
  axis.addEventListener('pointerdown', down)
  axis.addEventListener('dblclick', all)
  return () => {
    axis.removeEventListener('wheel', wheel)
    axis.removeEventListener('pointerdown', down)
    axis.removeEventListener('dblclick', all)
  }
}
