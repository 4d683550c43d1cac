import type { BlockType } from '../protocol'

/** Blocks that match the search text, best first: by title, then type and family, then description. */
export function matching(library: readonly BlockType[], typed: string): BlockType[] {
  const words = typed.toLowerCase().split(/\s+/).filter(Boolean)
  const ranked: [rank: number, kind: BlockType][] = []
  for (const kind of library) {
    let rank = 0
    for (const word of words) {
      const one = rankOf(kind, word)
      if (one === Infinity) rank = Infinity
      rank += one
    }
    if (rank < Infinity) ranked.push([rank, kind])
  }
  return ranked
    .sort(([a, x], [b, y]) => a - b || x.title.length - y.title.length || (x.title < y.title ? -1 : 1))
    .map(([, kind]) => kind)
}

function rankOf(kind: BlockType, word: string): number {
  const title = kind.title.toLowerCase()
  if (title === word) return 0
  if (title.startsWith(word)) return 1
  if (title.split(/[\s-]+/).some((part) => part.startsWith(word))) return 2
  if (kind.type.toLowerCase().includes(word)) return 3
  if (kind.family.startsWith(word)) return 4
  if (kind.summary.toLowerCase().includes(word)) return 5
  return subsequence(title, word) ? 6 : Infinity
}

function subsequence(text: string, letters: string): boolean {
  let at = 0
  for (const letter of letters) {
    at = text.indexOf(letter, at) + 1
    if (at === 0) return false
  }
  return true
}
