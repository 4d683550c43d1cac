import { sheetView } from '../canvas/sheet_actions'
import { newKey } from '../keys'
import type { Edit } from '../messages'
import { roundedPart } from '../model/bookmarks'
import { tabOf, type Tab } from '../model/tabs'
import type { SheetBookmark, SheetPart } from '../protocol'
import { ask, useStudio } from '../store'
import { partsToShow, sheetKey } from './document_views'
import { showSheetInTab } from './tabs'

/** The visible part of the shown sheet, in whole px; `null` if it is hidden. */
export function visiblePart(): SheetPart | null {
  const view = sheetView.visible?.()
  return view ? roundedPart(view) : null
}

/** Show the view of a bookmark of the shown document. */
export async function goTo({ inside, part }: SheetBookmark): Promise<void> {
  const { document } = useStudio.getState()
  if (document) await showPart(tabOf(document.state), inside, part)
}

/** Show a part of a sheet of the document of a tab. */
export async function showPart(tab: Tab, inside: string[], part: SheetPart): Promise<void> {
  const { document } = useStudio.getState()
  const key = sheetKey(tab.document, inside)
  if (document && sheetKey(document.state.document, document.inside) === key) sheetView.show?.(part)
  else partsToShow.set(key, part)
  await showSheetInTab(tab, inside)
}

/** Apply an edit of bookmarks to the sheet at a path; a refusal is shown as a notice. */
export async function applyEdit(edit: Edit, inside: string[]): Promise<boolean> {
  const document = useStudio.getState().document?.state.document
  if (document === undefined) return false
  return (await ask({ kind: 'change', document, key: newKey(), inside, edit })) !== undefined
}
