import type { FoundBlock } from '../protocol'

/** A document that was searched, with its results in their order. */
export interface SearchedDocument<Document> {
  document: Document
  label: string
  found: readonly FoundBlock[]
}

/** A result in the list of all documents. */
export interface SearchResult<Document> {
  document: Document
  found: FoundBlock
  key: string
  /** The heading of its group: the label of the document and the number of its results. */
  group: string
}

/** The number of results after which the server stops. */
export const MAX_FOUND = 50

/**
 * The results of all documents, document by document; results of the document in front are first. The
 * results of a single document have no headings.
 */
export function groupedResults<Document>(
  searched: readonly SearchedDocument<Document>[],
  inFront: number,
): SearchResult<Document>[] {
  const first = searched[inFront]
  const ordered = first ? [first, ...searched.filter((_, index) => index !== inFront)] : searched
  return ordered.flatMap(({ document, label, found }) =>
    found.map((one) => ({
      document,
      found: one,
      key: [label, ...one.inside, one.part ? ' ' : '', one.name].join('/'),
      group: searched.length > 1 ? `${label} · ${countText(found.length)}` : '',
    })),
  )
}

const countText = (count: number): string => (count < MAX_FOUND ? String(count) : `the first ${MAX_FOUND}`)
