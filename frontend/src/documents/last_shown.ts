import type { DocumentState } from '../protocol'

/** The last document of a tab, which is shown again after a reload. */
interface Shown {
  document: string
  inside: string[]
  path: string | null
  origin: string
}

const PLACE = 'armblocks-shown'

/** Store which document this tab shows; the address contains the path of its file. */
export function remember({ document, path, origin }: DocumentState, inside: string[]): void {
  const address = path ? `#${encodeURI(path)}` : ''
  if (location.hash !== address) history.replaceState(null, '', address || location.pathname)
  const shown: Shown = { document, inside, path, origin }
  sessionStorage.setItem(PLACE, JSON.stringify({ address, shown }))
}

/** The last document of this tab, unless its address has changed since. */
export function lastShown(): Shown | undefined {
  const kept = sessionStorage.getItem(PLACE)
  if (!kept) return undefined
  const { address, shown } = JSON.parse(kept) as { address: string; shown: Shown }
  return location.hash === address ? shown : undefined
}
