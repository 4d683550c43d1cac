/**
 * Views that follow a run are drawn as often as the machine allows. If rendering is slow, each frame is
 * followed by a pause, so that user input is handled in between.
 */

/** Duration of two frames above which pauses are inserted, ms. */
const FAST_FRAMES_MS = 60
/** Length of the pause, as a multiple of the duration of the frames. */
const PAUSE_FACTOR = 1.5

let pauseEnd = 0
let measuredFrame = 0

/** Whether the previous frames have been displayed, at a time of `performance.now()`. */
export function canDraw(now: number): boolean {
  return now >= pauseEnd
}

/**
 * Whether views that follow the run may be drawn in the animation frame `now`; the duration of this frame is
 * then measured.
 */
export function mayDraw(now: number): boolean {
  if (!canDraw(now)) return false
  if (measuredFrame !== now) {
    measuredFrame = now
    // Two frames, because a browser prepares one frame while it displays another.
    requestAnimationFrame(() =>
      requestAnimationFrame((later) => {
        if (later - now > FAST_FRAMES_MS) pauseEnd = Math.max(pauseEnd, later + PAUSE_FACTOR * (later - now))
      }),
    )
  }
  return true
}
