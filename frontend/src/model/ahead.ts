import type { Place, SheetBlock, SheetNote } from '../protocol'

/**
 * Positions that this page has sent to the server. The sheet shows them at once; the server's answer, which
 * takes longer on a large sheet, replaces them.
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
export function outstanding(sent: readonly SentMove[], sheet: Sheet): SentMove[] {
  const { document, version } = sheet.state
  const left = sent.filter(
    (one) => one.document !== document || one.version === null || one.version > version,
  )
  const first = left.findIndex((one) => isOn(one, sheet))
  // The change is sent before the reply. The server applies moves in order: only the oldest can have arrived.
  return first >= 0 && arrived(left[first]!, sheet) ? left.filter((_, k) => k !== first) : left
}

/** The sheet with the positions of the sent moves. */
export function withMoves<S extends Sheet>(sheet: S, sent: readonly SentMove[]): S {
  const own = sent.filter((one) => isOn(one, sheet))
  if (!own.length) return sheet
  const blocks = { ...sheet.blocks }
  const notes = { ...sheet.notes }
  for (const move of own) {
    for (const [name, place] of Object.entries(move.places))
      if (blocks[name]) blocks[name] = { ...blocks[name], place }
    for (const [id, note] of Object.entries(move.notes)) if (notes[id]) notes[id] = note
  }
  return { ...sheet, blocks, notes }
}

const isOn = (move: SentMove, { state, inside }: Sheet): boolean =>
  move.document === state.document && move.inside === pathOf(inside)

function arrived({ places, notes }: SentMove, sheet: Sheet): boolean {
  return (
    Object.entries(places).every(([name, place]) => {
      const now = sheet.blocks[name]?.place
      return !now || samePlace(now, place)
    }) &&
    Object.entries(notes).every(([id, { x, y }]) => {
      const now = sheet.notes[id]
      return !now || (now.x === x && now.y === y)
    })
  )
}

const samePlace = (one: Place, other: Place): boolean =>
  one.x === other.x &&
  one.y === other.y &&
  (one.width ?? null) === (other.width ?? null) &&
  (one.height ?? null) === (other.height ?? null) &&
  (one.flipped ?? false) === (other.flipped ?? false) &&
  (one.rotation ?? 0) === (other.rotation ?? 0)
