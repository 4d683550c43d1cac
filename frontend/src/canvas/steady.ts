import { useLayoutEffect, useRef, useState } from 'react'

type Handlers = Record<string, (...given: never[]) => unknown>

/**
 * Handlers that are the same functions at every drawing, and do what the latest ones do. React Flow tells
 * every block, port and wire of a sheet when it is given another function.
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
