import { useEffect, useState } from 'react'
import { Refusal } from '../connection'
import { orderedBookmarks } from '../model/bookmarks'
import type { SheetBookmark } from '../protocol'
import { connection, useStudio } from '../store'

/** The bookmarks of the shown document while `active`, sheet by sheet, requested again after each edit. */
export function useBookmarks(active: boolean): SheetBookmark[] | undefined {
  const document = useStudio((s) => s.document?.state.document)
  const version = useStudio((s) => s.document?.state.version)
  const [loaded, setLoaded] = useState<{ document: string; bookmarks: SheetBookmark[] }>()
  useEffect(() => {
    if (!active || document === undefined) return undefined
    let current = true
    connection.ask({ kind: 'bookmarks', document }).then(
      (bookmarks) => {
        if (current) setLoaded({ document, bookmarks: orderedBookmarks(bookmarks) })
      },
      (error: unknown) => {
        if (!(error instanceof Refusal)) throw error // the document was closed meanwhile
      },
    )
    return () => {
      current = false
    }
  }, [active, document, version])
  return loaded?.document === document ? loaded?.bookmarks : undefined
}
