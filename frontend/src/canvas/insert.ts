import { change, freeName, useStudio } from '../store'

/** px: where blocks may stand. */
export const GRID = 5

/** Put a new block of a type on the sheet, its middle at a point; it is selected then. */
export function insertBlock(type: string, at: { x: number; y: number }): void {
  const { document, library, select } = useStudio.getState()
  const kind = library.get(type)
  if (!document || !kind) return
  const name = freeName(kind.title.replace(/[/.]/g, ' '), Object.keys(document.blocks))
  const place = {
    x: GRID * Math.round((at.x - kind.width / 2) / GRID),
    y: GRID * Math.round((at.y - kind.height / 2) / GRID),
    flipped: false,
  }
  void change({ kind: 'add', blocks: [{ name, type, place }] }).then(() => select([name]))
}
