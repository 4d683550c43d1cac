import type { Request } from './messages'

const PLACE = 'armblocks-unsent'

/** Whether a request changes something, and may be sent twice: the server does what has a key once. */
const isAlteration = (request: Request) => 'key' in request && Boolean(request.key)

/** Note what this tab has asked for and has no answer to, so that a reload does not lose it. */
export function keepUnsent(requests: Iterable<Request>): void {
  const kept = [...requests].filter(isAlteration)
  try {
    if (kept.length) sessionStorage.setItem(PLACE, JSON.stringify(kept))
    else sessionStorage.removeItem(PLACE)
  } catch {
    // More than the browser keeps for a tab: it is still sent from memory, only a reload would lose it.
  }
}

/** What this tab had asked for before it was loaded anew. */
export function unsent(): Request[] {
  return JSON.parse(sessionStorage.getItem(PLACE) ?? '[]') as Request[]
}
