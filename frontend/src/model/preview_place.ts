import type { Rectangle } from './free_place'

/** Distance between a block and its preview, and of the preview from the edge of the window, px. */
const GAP = 10

/**
 * Position of a preview beside a block: below it, else above it, else on the side with more room. It never
 * covers the block, so that the block can still be clicked.
 */
export function previewPlace(
  block: Rectangle,
  preview: { width: number; height: number },
  frame: { width: number; height: number },
): { left: number; top: number } {
  const within = (start: number, size: number, available: number) =>
    Math.max(GAP, Math.min(start, available - size - GAP))
  const left = within(block.x + block.width / 2 - preview.width / 2, preview.width, frame.width)
  const below = block.y + block.height + GAP
  if (below + preview.height + GAP <= frame.height) return { left, top: below }
  const above = block.y - GAP - preview.height
  if (above >= GAP) return { left, top: above }
  const top = within(block.y + block.height / 2 - preview.height / 2, preview.height, frame.height)
  const right = block.x + block.width + GAP
  const isRightWider = frame.width - right > block.x
  return { left: isRightWider ? right : block.x - GAP - preview.width, top }
}

/** Size of a preview with a picture: its own size, or smaller to fit the limits. */
export function previewSize(
  picture: { width: number; height: number },
  limit: { width: number; height: number },
): { width: number; height: number } {
  const scale = Math.min(1, limit.width / picture.width, limit.height / picture.height)
  return { width: Math.round(picture.width * scale), height: Math.round(picture.height * scale) }
}
