import type { Request } from './messages'
import { storedData } from './stored_data'

const STORAGE_KEY = 'armblocks-unsent'

/** Whether a request changes something and can be repeated: the server applies each key once. */
const isKeyed = (request: Request) => 'key' in request && Boolean(request.key)

/** Store the requests of this tab without a reply, so that a reload does not lose them. */
export function storeUnsent(requests: Iterable<Request>): void {
  const alterations = [...requests].filter(isKeyed)
  try {
    if (alterations.length) sessionStorage.setItem(STORAGE_KEY, JSON.stringify(alterations))
    else sessionStorage.removeItem(STORAGE_KEY)
  } catch {
    // Over the storage limit of the browser: requests are still sent from memory, but a reload loses them.
  }
}

/** The stored requests from before the reload of this tab. */
export function unsent(): Request[] {
  return storedData<Request[]>(sessionStorage, STORAGE_KEY) ?? []
}
