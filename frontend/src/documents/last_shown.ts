import type { DocumentState } from '../protocol'

/** The document that a tab showed last, which is shown again after a reload. */
interface Shown {
  document: string
  inside: string[]
  path: string | null
  origin: string
}

const PLACE = 'armblocks-shown'

/** Note what this tab shows; a document that has a file gives the address its name. */
export function remember({ document, path, origin }: DocumentState, inside: string[]): void {
  const address = path ? `#${encodeURI(path)}` : ''
  if (location.hash !== address) history.replaceState(null, '', address || location.pathname)
  const shown: Shown = { document, inside, path, origin }
  sessionStorage.setItem(PLACE, JSON.stringify({ address, shown }))
}

/** What this tab showed last, unless it was given another address since. */
export function lastShown(): Shown | undefined {
  const kept = sessionStorage.getItem(PLACE)
  if (!kept) return undefined
  const { address, shown } = JSON.parse(kept) as { address: string; shown: Shown }
  return location.hash === address ? shown : undefined
}
