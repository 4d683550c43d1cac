import { useEffect, useState } from 'react'
import { Refusal } from '../connection'
import { showDialog, useDialogs } from '../dialogs'
import { showInTab, useTabs } from '../documents/tabs'
import { groupedResults, type SearchedDocument, type SearchResult } from '../model/search_results'
import { tabLabels, type Tab } from '../model/tabs'
import type { FoundBlock } from '../protocol'
import { useRobotEditor } from '../robot/editor/state'
import { connection, useStudio } from '../store'
import { PickList } from './pick_list'

const DEBOUNCE_MS = 80

/** Search of the blocks of all open diagrams by name, type or parameter value; Enter shows the block. */
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
          : `Names, types and values of all blocks of ${where}, in every subsystem.`
      }
      items={results.map(({ key, group, found: { inside, name, title, match } }) => ({
        key,
        group,
        title: name,
        note: [title, match, inside.length ? `in ${inside.join(' › ')}` : ''].filter(Boolean).join(' · '),
      }))}
      onPick={(index) => {
        const result = results[index]
        if (result) void showInTab(result.document, result.found.inside, result.found.name)
      }}
    />
  )
}

/** Search all diagrams of the page. */
async function search(text: string): Promise<SearchResult<Tab>[]> {
  const { tabs } = useTabs.getState()
  const labels = tabLabels(tabs)
  const searched = await Promise.all(
    tabs.map(async (tab, index): Promise<SearchedDocument<Tab>> => {
      const found = tab.kind === 'diagram' ? await foundIn(tab.document, text) : []
      return { document: tab, label: labels[index]!, found }
    }),
  )
  const inFront = useRobotEditor.getState().current ?? useStudio.getState().document?.state.document
  return groupedResults(
    searched,
    tabs.findIndex(({ document }) => document === inFront),
  )
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
