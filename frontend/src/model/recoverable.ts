import type { DocumentState, Recovery } from '../protocol'

/** The documents that can be recovered, without open documents. */
export function recoverable(
  recoveries: readonly Recovery[],
  documents: readonly Pick<DocumentState, 'document'>[],
): Recovery[] {
  return recoveries.filter((one) => !documents.some(({ document }) => document === one.document))
}
