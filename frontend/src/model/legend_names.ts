/** The names of a legend with too little space: the shorter names are whole, the longer ones are cut. */

const ELLIPSIS = '…'
/** Least number of letters of a cut name, without the ellipsis; names with two more are whole. */
const MIN_LETTERS = 6

/** The width of a text, px. */
export type Measure = (text: string) => number

/** The name of a trace: its signal, and its entry, which is empty for a scalar. */
export interface LegendName {
  name: string
  entry: string
}

/**
 * The texts of names in `room` px. Texts up to a common width are whole, and each longer text is cut to this
 * width, so a short name is never cut in favour of a long one. The cut is in the middle of the name, or where
 * the text remains different from all others; a short entry is never cut. In too little room, names have
 * `MIN_LETTERS` letters, and the texts are longer than the room.
 */
export function legendNames(names: readonly LegendName[], room: number, measure: Measure): string[] {
  const texts = names.map(({ name, entry }) => (entry ? `${name} ${entry}` : name))
  const widths = texts.map(measure)
  const limit = commonWidth(widths, room)
  return names.map(({ name, entry }, k) => {
    const text = texts[k]!
    if (widths[k]! <= limit) return text
    const suffix = entry && ` ${entry}`
    if (!suffix || 2 * measure(suffix) > limit) return shortened(text, limit, measure, texts)
    // Texts with other entries differ anyway.
    const rivals = names.filter((other) => other.entry === entry).map((other) => other.name)
    return shortened(name, limit - measure(suffix), measure, rivals) + suffix
  })
}

/** The width to which texts are cut so that they fit into `room`; infinite if they fit completely. */
function commonWidth(widths: readonly number[], room: number): number {
  let [remaining, count] = [room, widths.length]
  for (const width of [...widths].sort((a, b) => a - b)) {
    if (width * count > remaining) return Math.max(remaining / count, 0)
    remaining -= width
    count--
  }
  return Infinity
}

/** A text with an ellipsis that fits into a width; different from other texts cut at the same place. */
function shortened(text: string, width: number, measure: Measure, texts: readonly string[]): string {
  const letters = Array.from(text)
  if (letters.length <= MIN_LETTERS + 2) return text
  const others = [...new Set(texts)].filter((other) => other !== text).map((other) => Array.from(other))
  let kept = letters.length - 2
  const middle = (count: number) => Math.ceil(count / 2)
  const fits = (head: number) => kept <= MIN_LETTERS || measure(cut(letters, head, kept - head)) <= width
  while (!fits(middle(kept))) kept--
  const heads = Array.from({ length: kept + 1 }, (_, head) => head).sort(
    (a, b) => Math.abs(a - middle(kept)) - Math.abs(b - middle(kept)),
  )
  const distinct = heads.find((head) => {
    const shown = cut(letters, head, kept - head)
    return others.every((other) => cut(other, head, kept - head) !== shown) && fits(head)
  })
  if (distinct !== undefined) return cut(letters, distinct, kept - distinct)
  const [start, end] = differentPart(letters, others, kept - 1)
  return start > 0 && end < letters.length
    ? ELLIPSIS + letters.slice(start, end).join('') + ELLIPSIS
    : cut(letters, middle(kept), kept - middle(kept))
}

/** The part of a text, of a length, from the letter at which it differs from the most similar other text. */
function differentPart(
  letters: readonly string[],
  others: readonly (readonly string[])[],
  length: number,
): [number, number] {
  const common = others.map((other) => {
    const first = letters.findIndex((letter, k) => letter !== other[k])
    return first < 0 ? letters.length : first
  })
  const start = Math.max(0, ...common)
  return [start, start + length]
}

/** The first and the last letters of a text, with an ellipsis between them. */
function cut(letters: readonly string[], head: number, tail: number): string {
  if (head + tail >= letters.length) return letters.join('')
  return letters.slice(0, head).join('') + ELLIPSIS + letters.slice(letters.length - tail).join('')
}

/** A text of the legend of a picture, and its place: the row, and the left edge, px. */
export interface PlacedName {
  text: string
  x: number
  row: number
}

/**
 * The legend of a picture, which cannot be scrolled. The names are whole, in as many rows as they need. A
 * name is cut only if it is longer than a row. The first row begins at `first`, the others at `left`, px;
 * `margin` is the width of an entry in addition to its text.
 */
export function legendRows(
  names: readonly LegendName[],
  { first, left, right, margin }: { first: number; left: number; right: number; margin: number },
  measure: Measure,
): PlacedName[] {
  let [x, row] = [first, 0]
  return names.map((name) => {
    const [text = ''] = legendNames([name], right - left - margin, measure)
    const width = measure(text) + margin
    if (x + width > right && x > left) {
      x = left
      row++
    }
    const placed = { text, x, row }
    x += width
    return placed
  })
}
