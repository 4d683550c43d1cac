/**
 * Views that follow a run are drawn as often as the machine allows. If rendering is slow, each frame is
 * followed by a pause, so that user input is handled in between.
 */

/** Duration of two frames above which pauses are inserted, ms. */
const QUICK_MS = 60
/** Length of the pause, as a multiple of the duration of the frames. */
const PAUSE = 1.5

let freeAt = 0
let drawn = 0

/** Whether the previous frames have been displayed, at a time of `performance.now()`. */
export function isFree(now: number): boolean {
  return now >= freeAt
}

/**
 * Whether views that follow the run may be drawn in the animation frame `now`; the duration of this frame is
 * then measured.
 */
export function mayFollow(now: number): boolean {
  if (!isFree(now)) return false
  if (drawn !== now) {
    drawn = now
    // Two frames, because a browser prepares one frame while it displays another.
    requestAnimationFrame(() =>
      requestAnimationFrame((then) => {
        if (then - now > QUICK_MS) freeAt = Math.max(freeAt, then + PAUSE * (then - now))
      }),
    )
  }
  return true
}
