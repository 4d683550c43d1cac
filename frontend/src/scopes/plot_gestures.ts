import type uPlot from 'uplot'
import { useCursor } from '../run/cursor'
import { pan, visibleTimes, useWindow, zoomBy } from './window'

const CURSOR_PX = 6
export const CLICK_PX = 3
export type Values = [low: number, high: number]

/** The measuring cursor under the pointer. */
export function cursorUnder(plot: uPlot, event: MouseEvent): 0 | 1 | null {
  const { cursors } = useWindow.getState()
  if (!cursors) return null
  const x = event.clientX - plot.over.getBoundingClientRect().left
  const distances = cursors.map((time) => Math.abs(plot.valToPos(time, 'x') - x))
  const nearest = distances[0]! <= distances[1]! ? 0 : 1
  return distances[nearest]! <= CURSOR_PX ? nearest : null
}

/** The wheel zooms, Shift or the middle button pans, a click selects a time, cursors are dragged. */
export function listenOnPlot(plot: uPlot): () => void {
  const { over } = plot
  const timeOf = (event: MouseEvent) => plot.posToVal(event.clientX - over.getBoundingClientRect().left, 'x')
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const [from, to] = visibleTimes()
    if (event.shiftKey || event.deltaX) pan(((to - from) * (event.deltaX || event.deltaY)) / over.clientWidth)
    else zoomBy(event.deltaY > 0 ? 1.25 : 0.8, timeOf(event))
  }
  const down = (event: PointerEvent) => {
    if (event.button === 2) return
    const cursorIndex = cursorUnder(plot, event)
    const panning = event.button === 1 || event.shiftKey
    const from = event.clientX
    let last = event.clientX
    const move = (moved: PointerEvent) => {
      const { cursors } = useWindow.getState()
      if (cursorIndex !== null && cursors) {
        const [first, end] = visibleTimes()
        const time = Math.min(Math.max(timeOf(moved), first), end)
        useWindow.setState({ cursors: cursorIndex ? [cursors[0], time] : [time, cursors[1]] })
      } else if (panning) {
        const [first, end] = visibleTimes()
        pan(((end - first) * (last - moved.clientX)) / over.clientWidth)
        last = moved.clientX
      }
    }
    const up = (ended: PointerEvent) => {
      removeEventListener('pointermove', move)
      removeEventListener('pointerup', up)
      if (cursorIndex === null && !panning && Math.abs(ended.clientX - from) < CLICK_PX)
        useCursor.setState({ time: Math.max(timeOf(ended), 0), playing: false })
    }
    if (panning || cursorIndex !== null) event.preventDefault()
    addEventListener('pointermove', move)
    addEventListener('pointerup', up)
  }
  const hover = (event: PointerEvent) => {
    over.style.cursor = cursorUnder(plot, event) === null ? '' : 'ew-resize'
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

const ZOOM_FACTOR = 1.25

/**
 * On the value axis the wheel zooms about the pointer, dragging pans, and a double click shows all values.
 */
export function listenOnValueAxis(plot: uPlot, show: (values: Values | null) => void): () => void {
  const axis = plot.root.querySelectorAll<HTMLElement>('.u-axis')[1]
  if (!axis) return () => {}
  axis.classList.add('values-axis')
  axis.title = 'Wheel: zoom the values. Drag: move them. Double click: show all.'
  const visibleRange = (): Values => [plot.scales['y']?.min ?? 0, plot.scales['y']?.max ?? 1]
  const valueOf = (event: MouseEvent) =>
    plot.posToVal(event.clientY - plot.over.getBoundingClientRect().top, 'y')
  const wheel = (event: WheelEvent) => {
    event.preventDefault()
    const factor = event.deltaY > 0 ? ZOOM_FACTOR : 1 / ZOOM_FACTOR
    const centre = valueOf(event)
    show(visibleRange().map((end) => centre + factor * (end - centre)) as Values)
  }
  const down = (event: PointerEvent) => {
    if (event.button !== 0) return
    const initialRange = visibleRange()
    const start = event.clientY
    axis.setPointerCapture(event.pointerId)
    const move = (moved: PointerEvent) => {
      const shift = ((moved.clientY - start) / plot.over.clientHeight) * (initialRange[1] - initialRange[0])
      if (Math.abs(moved.clientY - start) >= CLICK_PX)
        show([initialRange[0] + shift, initialRange[1] + shift])
    }
    const up = () => {
      axis.removeEventListener('pointermove', move)
      axis.removeEventListener('pointerup', up)
    }
    axis.addEventListener('pointermove', move)
    axis.addEventListener('pointerup', up)
  }
  const showAll = () => show(null)
  axis.addEventListener('wheel', wheel, { passive: false })
  axis.addEventListener('pointerdown', down)
  axis.addEventListener('dblclick', showAll)
  return () => {
    axis.removeEventListener('wheel', wheel)
    axis.removeEventListener('pointerdown', down)
    axis.removeEventListener('dblclick', showAll)
  }
}
