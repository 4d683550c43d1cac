import type { DocumentState, Recovery } from '../protocol'

/** The documents that can be recovered, without those that are open. */
export function recoverable(
  recoveries: readonly Recovery[],
  documents: readonly Pick<DocumentState, 'document'>[],
): Recovery[] {
  return recoveries.filter((one) => !documents.some(({ document }) => document === one.document))
}
