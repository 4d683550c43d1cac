import { useLayoutEffect, useRef, useState } from 'react'

type Handlers = Record<string, (...given: never[]) => unknown>

/**
 * Handlers that are the same function objects at every rendering and call the latest versions. React Flow
 * renders every block, port and wire of a sheet again if it receives another function.
 */
export function useSteady<T extends Handlers>(latest: T): T {
  const now = useRef(latest)
  useLayoutEffect(() => {
    now.current = latest
  })
  const [steady] = useState(
    () =>
      Object.fromEntries(
        Object.keys(latest).map((name) => [name, (...given: never[]) => now.current[name]!(...given)]),
      ) as T,
  )
  return steady
}
