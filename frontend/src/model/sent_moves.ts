import type { Place, SheetBlock, SheetNote } from '../protocol'

/**
 * Positions that this client has sent to the server. The sheet shows them at once; the reply of the server
 * replaces them.
 */
export interface SentMove {
  key: string
  document: string
  inside: string
  /** The version of the document with this move; `null` before the reply of the server. */
  version: number | null
  places: Record<string, Place>
  notes: Record<string, SheetNote>
}

interface Sheet {
  state: { document: string; version: number }
  inside: string[]
  blocks: Record<string, SheetBlock>
  notes: Record<string, SheetNote>
}

export const pathOf = (inside: readonly string[]): string => inside.join('/')

/** The sent moves that a state of the document from the server does not contain yet, in order. */
export function outstandingMoves(sent: readonly SentMove[], sheet: Sheet): SentMove[] {
  const { document, version } = sheet.state
  const remaining = sent.filter(
    (sentMove) => sentMove.document !== document || sentMove.version === null || sentMove.version > version,
  )
  const first = remaining.findIndex((sentMove) => isOnSheet(sentMove, sheet))
  // The server sends the changed document before its reply, and applies moves in order: of the moves without
  // a reply, only the oldest can be in the document.
  return first >= 0 && isContained(remaining[first]!, sheet)
    ? remaining.filter((_, k) => k !== first)
    : remaining
}

/** The sheet with the positions of the sent moves. */
export function withMoves<S extends Sheet>(sheet: S, sent: readonly SentMove[]): S {
  const sheetMoves = sent.filter((move) => isOnSheet(move, sheet))
  if (!sheetMoves.length) return sheet
  const blocks = { ...sheet.blocks }
  const notes = { ...sheet.notes }
  for (const move of sheetMoves) {
    for (const [name, place] of Object.entries(move.places))
      if (blocks[name]) blocks[name] = { ...blocks[name], place }
    for (const [id, note] of Object.entries(move.notes)) if (notes[id]) notes[id] = note
  }
  return { ...sheet, blocks, notes }
}

const isOnSheet = (move: SentMove, { state, inside }: Sheet): boolean =>
  move.document === state.document && move.inside === pathOf(inside)

function isContained({ places, notes }: SentMove, sheet: Sheet): boolean {
  return (
    Object.entries(places).every(([name, place]) => {
      const present = sheet.blocks[name]?.place
      return !present || equalPlaces(present, place)
    }) &&
    Object.entries(notes).every(([id, { x, y }]) => {
      const present = sheet.notes[id]
      return !present || (present.x === x && present.y === y)
    })
  )
}

const equalPlaces = (a: Place, b: Place): boolean =>
  a.x === b.x &&
  a.y === b.y &&
  (a.width ?? null) === (b.width ?? null) &&
  (a.height ?? null) === (b.height ?? null) &&
  (a.flipped ?? false) === (b.flipped ?? false) &&
  (a.rotation ?? 0) === (b.rotation ?? 0)
