/** Key combinations of one part of the front end, and their effects. */
export interface KeyGroup {
  title: string
  keys: [combinations: string, effect: string][]
}

interface KeyedCommand {
  title: string
  keys?: string | undefined
  sheetOnly?: boolean
}

/** The groups of the key map: the commands with keys, then the keys of the parts of the front end. */
export function keyGroups(commands: readonly KeyedCommand[], parts: readonly KeyGroup[]): KeyGroup[] {
  const keysOf = (sheetOnly: boolean) =>
    commands
      .filter((command) => (command.sheetOnly ?? false) === sheetOnly)
      .flatMap(({ keys, title }): [string, string][] => (keys ? [[keys, title]] : []))
  return [
    { title: 'Commands', keys: keysOf(false) },
    { title: 'Commands of the sheet', keys: keysOf(true) },
    ...parts,
  ]
}
