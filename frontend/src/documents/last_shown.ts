import type { DocumentState } from '../protocol'
import { storedData } from '../stored_data'

/** The last document of a tab, which is shown again after a reload. */
interface ShownDocument {
  document: string
  inside: string[]
  path: string | null
  origin: string
}

const STORAGE_KEY = 'armblocks-shown'

/** Store which document this tab shows; the address contains the path of its file. */
export function storeShown({ document, path, origin }: DocumentState, inside: string[]): void {
  const address = path ? `#${encodeURI(path)}` : ''
  if (location.hash !== address) history.replaceState(null, '', address || location.pathname)
  const shown: ShownDocument = { document, inside, path, origin }
  sessionStorage.setItem(STORAGE_KEY, JSON.stringify({ address, shown }))
}

/** The last document of this tab, unless its address has changed since. */
export function lastShown(): ShownDocument | undefined {
  const stored = storedData<{ address: string; shown: ShownDocument }>(sessionStorage, STORAGE_KEY)
  return stored && location.hash === stored.address ? stored.shown : undefined
}
