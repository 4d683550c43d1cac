/**
 * Views of data outside React's state: samples, the time cursor, sizes. Each view is called in the animation
 * frame after a change and compares the present data with the drawn data. Without changes the page requests
 * no frames.
 */
type Look = (now: number) => void

const looks = new Set<Look>()
let requested = 0

/** Run all views in the next animation frame. */
export function changed(): void {
  requested ||= requestAnimationFrame((now) => {
    requested = 0 // a view may request the frame after this one
    for (const look of looks) look(now)
  })
}

/**
 * Call `look` in the next animation frame and in the frame after every change. Returns a function that ends
 * this.
 */
export function watch(look: Look): () => void {
  looks.add(look)
  changed()
  return () => void looks.delete(look)
}
