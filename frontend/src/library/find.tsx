import { useEffect, useState } from 'react'
import { Refusal } from '../connection'
import { showDialog, useDialogs } from '../dialogs'
import { showPart } from '../documents/bookmarks'
import { showInTab, showTab, useTabs } from '../documents/tabs'
import { groupedResults, type SearchedDocument, type SearchResult } from '../model/search_results'
import { tabLabels, type Tab } from '../model/tabs'
import type { FoundBlock } from '../protocol'
import { useRobotEditor } from '../robot/editor/state'
import { connection, useStudio } from '../store'
import { PickList } from './pick_list'

const DEBOUNCE_MS = 80

/** Search of the blocks and bookmarks of all open diagrams, and of open robots; Enter shows the result. */
export function Find() {
  const opened = useDialogs((s) => s.open === 'find')
  const typed = useDialogs((s) => s.typed)
  const severalDocuments = useTabs((s) => s.tabs.filter(({ kind }) => kind === 'diagram').length > 1)
  const [results, setResults] = useState<SearchResult<Tab>[]>([])
  useEffect(() => {
    setResults([])
    if (!opened || !typed.trim()) return
    let current = true
    const timer = setTimeout(
      () => void search(typed).then((reply) => current && setResults(reply)),
      DEBOUNCE_MS,
    )
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, [opened, typed])
  const where = severalDocuments ? 'the open diagrams' : 'the model'
  return (
    <PickList
      opened={opened}
      onClose={() => showDialog(null)}
      label="Find"
      placeholder={`Find in ${where}: a name, a type, a value`}
      list="Found"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      emptyText={
        typed.trim()
          ? `Nothing in ${where} matches “${typed}”.`
          : `Names, types and values of all blocks, and bookmarks, of ${where}, in every subsystem.`
      }
      items={results.map(({ key, group, found: { inside, name, title, match, part } }) => ({
        key,
        group,
        title: name,
        note: [part ? 'Bookmark' : title, match, inside.length ? `in ${inside.join(' › ')}` : '']
          .filter(Boolean)
          .join(' · '),
      }))}
      onPick={(index) => {
        const result = results[index]
        if (!result) return
        const { inside, name, part } = result.found
        if (result.document.kind === 'robot') void showTab(result.document)
        else void (part ? showPart(result.document, inside, part) : showInTab(result.document, inside, name))
      }}
    />
  )
}

/** Search all open diagrams of this client, and its robots by name. */
async function search(text: string): Promise<SearchResult<Tab>[]> {
  const { tabs } = useTabs.getState()
  const labels = tabLabels(tabs)
  const searched = await Promise.all(
    tabs.map(async (tab, index): Promise<SearchedDocument<Tab>> => {
      const label = labels[index]!
      const found =
        tab.kind === 'diagram' ? await foundIn(tab.document, text) : robotNamed(label, tab.path ?? '', text)
      return { document: tab, label, found }
    }),
  )
  const inFront = useRobotEditor.getState().current ?? useStudio.getState().document?.state.document
  return groupedResults(
    searched,
    tabs.findIndex(({ document }) => document === inFront),
  )
}

/** The robot of a tab, if its name and the path of its file contain every word. */
function robotNamed(name: string, path: string, text: string): FoundBlock[] {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean)
  const matches = words.every((word) => `${name} ${path}`.toLowerCase().includes(word))
  return matches ? [{ inside: [], name, title: 'Robot', match: '' }] : []
}

/** The results in one diagram; none if it was closed meanwhile. */
async function foundIn(document: string, text: string): Promise<FoundBlock[]> {
  try {
    return await connection.ask({ kind: 'find', document, text })
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    return []
  }
}
