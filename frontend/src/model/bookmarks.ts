import type { SheetBookmark, SheetPart } from '../protocol'
import { inNaturalOrder } from './natural_order'

/** A part rounded to whole px, so that its text in the file is short; `null` if the sheet is not visible. */
export function roundedPart({ x, y, width, height }: SheetPart): SheetPart | null {
  const [left, top] = [Math.round(x), Math.round(y)]
  const part = { x: left, y: top, width: Math.round(width), height: Math.round(height) }
  return part.width >= 1 && part.height >= 1 ? part : null
}

/** The proposed name of a bookmark: the only selected block, otherwise the sheet. */
export function preferredName(selection: Iterable<string>, sheetName: string): string {
  const [first, second] = selection
  return first !== undefined && second === undefined ? first : sheetName
}

/** The bookmarks whose names contain every typed word. */
export function matchingBookmarks(bookmarks: readonly SheetBookmark[], typed: string): SheetBookmark[] {
  const words = typed.toLowerCase().split(/\s+/).filter(Boolean)
  return bookmarks.filter(({ name }) => words.every((word) => name.toLowerCase().includes(word)))
}

/** The key of a bookmark in lists: names are unique on their sheet. */
export const bookmarkKey = ({ inside, name }: Pick<SheetBookmark, 'inside' | 'name'>): string =>
  [...inside, ` ${name}`].join('/')

/** The bookmarks ordered by sheet, then by name; numbers in names are compared as numbers. */
export function orderedBookmarks(bookmarks: readonly SheetBookmark[]): SheetBookmark[] {
  const byName = inNaturalOrder(bookmarks, ({ name }) => name)
  return inNaturalOrder(byName, ({ inside }) => inside.join('/'))
}
