import type { BlockType } from '../protocol'

/** Blocks that match the search text, best first: by title, then type and family, then description. */
export function matching(library: readonly BlockType[], typed: string): BlockType[] {
  const words = typed.toLowerCase().split(/\s+/).filter(Boolean)
  const ranked: [rank: number, kind: BlockType][] = []
  for (const blockType of library) {
    let rank = 0
    for (const word of words) {
      const wordRank = rankOf(blockType, word)
      if (wordRank === Infinity) rank = Infinity
      rank += wordRank
    }
    if (rank < Infinity) ranked.push([rank, blockType])
  }
  return ranked
    .sort(([a, x], [b, y]) => a - b || x.title.length - y.title.length || (x.title < y.title ? -1 : 1))
    .map(([, blockType]) => blockType)
}

function rankOf(blockType: BlockType, word: string): number {
  const title = blockType.title.toLowerCase()
  if (title === word) return 0
  if (title.startsWith(word)) return 1
  if (title.split(/[\s-]+/).some((part) => part.startsWith(word))) return 2
  if (blockType.type.toLowerCase().includes(word)) return 3
  if (blockType.family.startsWith(word)) return 4
  if (blockType.summary.toLowerCase().includes(word)) return 5
  return subsequence(title, word) ? 6 : Infinity
}

function subsequence(text: string, letters: string): boolean {
  let position = 0
  for (const letter of letters) {
    position = text.indexOf(letter, position) + 1
    if (position === 0) return false
  }
  return true
}
