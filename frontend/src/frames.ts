/**
 * Views of data outside React's state: samples, the time cursor, sizes. Each view is called in the animation
 * frame after a change and compares the present data with the drawn data. Without changes the front end
 * requests no frames.
 */
type FrameCallback = (now: number) => void

const callbacks = new Set<FrameCallback>()
let requested = 0

/** Run all views in the next animation frame. */
export function scheduleFrame(): void {
  requested ||= requestAnimationFrame((now) => {
    requested = 0 // a view may request the next frame
    for (const callback of callbacks) callback(now)
  })
}

/**
 * Call `callback` in the next animation frame and in the frame after every change. Returns a function that
 * ends the calls.
 */
export function onFrame(callback: FrameCallback): () => void {
  callbacks.add(callback)
  scheduleFrame()
  return () => void callbacks.delete(callback)
}
