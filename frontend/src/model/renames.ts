/** Paths of renamed blocks from the top sheet: old to new. */
export type Renamed = Readonly<Record<string, string>>

/** The path of a block, port (`block/port`) or parameter (`block.parameter`) after blocks were renamed. */
export function pathAfter(path: string, renamed: Renamed): string {
  for (const [before, after] of Object.entries(renamed))
    if (path === before || path.startsWith(`${before}/`) || path.startsWith(`${before}.`))
      return after + path.slice(before.length)
  return path
}

/** A message about a run in which quoted paths, such as `'plant/arm'`, have the names after a rename. */
export const textAfter = (text: string, renamed: Renamed): string =>
  text.replace(/'([^'\n]+)'/g, (_, path: string) => `'${pathAfter(path, renamed)}'`)

/** A record with the paths of its keys after blocks were renamed. */
export const withKeysAfter = <T>(record: Readonly<Record<string, T>>, renamed: Renamed): Record<string, T> =>
  Object.fromEntries(Object.entries(record).map(([path, value]) => [pathAfter(path, renamed), value]))

/** Paths after blocks were renamed. */
export const pathsAfter = (paths: Iterable<string>, renamed: Renamed): Set<string> =>
  new Set([...paths].map((path) => pathAfter(path, renamed)))
