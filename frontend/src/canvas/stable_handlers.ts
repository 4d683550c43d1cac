import { useLayoutEffect, useRef, useState } from 'react'

type Handlers = Record<string, (...args: never[]) => unknown>

/**
 * Handlers that are the same function objects at every rendering and call the latest versions. React Flow
 * renders every block, port and wire of a sheet again if it receives another function.
 */
export function useStableHandlers<T extends Handlers>(latest: T): T {
  const current = useRef(latest)
  useLayoutEffect(() => {
    current.current = latest
  })
  const [stable] = useState(
    () =>
      Object.fromEntries(
        Object.keys(latest).map((name) => [name, (...args: never[]) => current.current[name]!(...args)]),
      ) as T,
  )
  return stable
}
