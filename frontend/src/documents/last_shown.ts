import type { DocumentState } from '../protocol'

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
  const stored = sessionStorage.getItem(STORAGE_KEY)
  if (!stored) return undefined
  const { address, shown } = JSON.parse(stored) as { address: string; shown: ShownDocument }
  return location.hash === address ? shown : undefined
}
