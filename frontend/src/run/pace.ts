/**
 * Views that follow a run are drawn as often as the machine allows. If rendering is slow, a pause follows
 * each frame, so that user input is handled in between.
 */

/** ms that two pictures may take without a pause. */
const QUICK_MS = 60
/** The pause, in times of what the pictures took. */
const PAUSE = 1.5

let freeAt = 0
let drawn = 0

/** Whether the pictures of before are on the screen, at an instant of `performance.now()`. */
export function isFree(now: number): boolean {
  return now >= freeAt
}

/**
 * Whether what follows the run may be drawn in the animation frame `now`; it is measured then what that
 * costs.
 */
export function mayFollow(now: number): boolean {
  if (!isFree(now)) return false
  if (drawn !== now) {
    drawn = now
    // Two frames, because a browser prepares one picture while it shows another.
    requestAnimationFrame(() =>
      requestAnimationFrame((then) => {
        if (then - now > QUICK_MS) freeAt = Math.max(freeAt, then + PAUSE * (then - now))
      }),
    )
  }
  return true
}
