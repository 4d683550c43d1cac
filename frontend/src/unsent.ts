import type { Request } from './messages'

const PLACE = 'armblocks-unsent'

/** Whether a request changes something and can be repeated: the server applies each key once. */
const isAlteration = (request: Request) => 'key' in request && Boolean(request.key)

/** Store the requests of this tab without a reply, so that a reload does not lose them. */
export function keepUnsent(requests: Iterable<Request>): void {
  const kept = [...requests].filter(isAlteration)
  try {
    if (kept.length) sessionStorage.setItem(PLACE, JSON.stringify(kept))
    else sessionStorage.removeItem(PLACE)
  } catch {
    // Over the storage limit of the browser: requests are still sent from memory, but a reload loses them.
  }
}

/** The stored requests from before the reload of this tab. */
export function unsent(): Request[] {
  return JSON.parse(sessionStorage.getItem(PLACE) ?? '[]') as Request[]
}
