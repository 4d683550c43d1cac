import type { DocumentState, Recovery } from '../protocol'

/** A document that is open in this client; the fields identify it also after a restart of the studio. */
export type Tab = Pick<DocumentState, 'document' | 'kind' | 'path' | 'origin' | 'title'>

export const tabOf = ({ document, kind, path, origin, title }: DocumentState): Tab => ({
  document,
  kind,
  path,
  origin,
  title,
})

/** The tabs with a document: in its place if it has one, otherwise at the end. */
export function withTab(tabs: readonly Tab[], tab: Tab): Tab[] {
  const index = tabs.findIndex(({ document }) => document === tab.document)
  return index < 0 ? [...tabs, tab] : tabs.with(index, tab)
}

/** The tabs with the present paths and titles of their documents. */
export function updatedTabs(tabs: readonly Tab[], documents: readonly DocumentState[]): Tab[] {
  const states = new Map(documents.map((state) => [state.document, state]))
  return tabs.map((tab) => {
    const state = states.get(tab.document)
    return state ? tabOf(state) : tab
  })
}

/** The tab that is shown after a tab is closed: the next one, or the previous one after the last. */
export function neighbour(tabs: readonly Tab[], document: string): Tab | undefined {
  const index = tabs.findIndex((tab) => tab.document === document)
  return tabs[index + 1] ?? tabs[index - 1]
}

/** The tab a number of steps to the right; the first tab follows the last. */
export function tabAfter(tabs: readonly Tab[], document: string | undefined, steps: number): Tab | undefined {
  const index = tabs.findIndex((tab) => tab.document === document)
  return tabs[(index + steps + tabs.length) % tabs.length]
}

/** The labels of the tabs: titles, with the folder or a number where a title is not unique. */
export function tabLabels(tabs: readonly Tab[]): string[] {
  const counts = new Map<string, number>()
  for (const { title } of tabs) counts.set(title, (counts.get(title) ?? 0) + 1)
  const numbers = new Map<string, number>()
  return tabs.map(({ title, path }) => {
    if (counts.get(title) === 1) return title
    if (path) return path.replace(/\.json$/, '')
    const number = (numbers.get(title) ?? 0) + 1
    numbers.set(title, number)
    return number === 1 ? title : `${title} (${number})`
  })
}

/** The labels of the open documents, as the tabs show them; documents without a tab follow the others. */
export function documentLabels(
  tabs: readonly Tab[],
  documents: readonly DocumentState[],
): ReadonlyMap<string, string> {
  const shown = new Set(tabs.map(({ document }) => document))
  const all = [...tabs, ...documents.filter(({ document }) => !shown.has(document)).map(tabOf)]
  const labels = tabLabels(all)
  return new Map(all.map(({ document }, k) => [document, labels[k]!]))
}

/**
 * The tabs that the server can open again. A document without file and origin that is missing on the server
 * had no edits, or they were discarded.
 */
export function restorableTabs(
  tabs: readonly Tab[],
  documents: readonly Pick<DocumentState, 'document'>[],
  recoveries: readonly Pick<Recovery, 'document'>[],
): Tab[] {
  const known = new Set([...documents, ...recoveries].map(({ document }) => document))
  return tabs.filter(({ document, path, origin }) => known.has(document) || path || origin)
}
