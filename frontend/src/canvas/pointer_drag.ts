/** The handlers of a drag: at each movement, at the release of the button, and at the end for any reason. */
interface Drag {
  move: (event: PointerEvent) => void
  drop: (event: PointerEvent) => void
  finish: (dropped: boolean) => void
}

/** Call a function when Escape is pressed, before any other handler, until the signal is aborted. */
export function onEscape(cancel: () => void, signal: AbortSignal): void {
  addEventListener(
    'keydown',
    (event) => {
      if (event.key !== 'Escape') return
      event.stopImmediatePropagation()
      cancel()
    },
    { signal, capture: true },
  )
}

/**
 * Follow a pressed pointer until its button is released. Escape or a cancelled pointer ends the drag without
 * a drop.
 */
export function followPointer(
  pointerDown: PointerEvent | React.PointerEvent,
  { move, drop, finish }: Drag,
): void {
  const { button, pointerId } = pointerDown
  const listeners = new AbortController()
  const { signal } = listeners
  const cancel = () => {
    listeners.abort()
    finish(false)
  }
  addEventListener('pointermove', (event) => event.pointerId === pointerId && move(event), { signal })
  addEventListener(
    'pointerup',
    (event) => {
      if (event.button !== button) return
      listeners.abort()
      drop(event)
      finish(true)
    },
    { signal },
  )
  addEventListener('pointercancel', cancel, { signal })
  onEscape(cancel, signal)
}
