/** What a drag does at each movement, when the button is released, and at its end for any reason. */
interface Drag {
  move: (event: PointerEvent) => void
  drop: (event: PointerEvent) => void
  leave: () => void
}

/**
 * Follow a pressed pointer until its button is released. Escape or a cancelled pointer ends the drag without
 * a drop.
 */
export function followPointer(pressed: PointerEvent | React.PointerEvent, { move, drop, leave }: Drag): void {
  const { button, pointerId } = pressed
  const listening = new AbortController()
  const { signal } = listening
  const end = () => {
    listening.abort()
    leave()
  }
  addEventListener('pointermove', (event) => event.pointerId === pointerId && move(event), { signal })
  addEventListener(
    'pointerup',
    (event) => {
      if (event.button !== button) return
      listening.abort()
      drop(event)
      leave()
    },
    { signal },
  )
  addEventListener('pointercancel', end, { signal })
  addEventListener(
    'keydown',
    (event) => {
      if (event.key !== 'Escape') return
      event.stopPropagation()
      end()
    },
    { signal, capture: true },
  )
}
