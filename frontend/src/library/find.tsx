import { useEffect, useState } from 'react'
import { showDialog, useDialogs } from '../dialogs'
import type { FoundBlock } from '../protocol'
import { ask, showBlock, useStudio } from '../store'
import { PickList } from './pick_list'

const DEBOUNCE_MS = 80

/** Search of all blocks of the model by name, type or parameter value; Enter shows the block. */
export function Find() {
  const opened = useDialogs((s) => s.open === 'find')
  const typed = useDialogs((s) => s.typed)
  const document = useStudio((s) => s.document?.state.document)
  const [matches, setMatches] = useState<FoundBlock[]>([])
  useEffect(() => {
    setMatches([])
    if (!opened || !document || !typed.trim()) return
    let current = true
    const timer = setTimeout(() => {
      void ask({ kind: 'find', document, text: typed }).then((reply) => current && setMatches(reply ?? []))
    }, DEBOUNCE_MS)
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, [opened, document, typed])
  return (
    <PickList
      opened={opened}
      onClose={() => showDialog(null)}
      label="Find"
      placeholder="Find in the model: a name, a type, a value"
      list="Found"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      emptyText={
        typed.trim()
          ? `Nothing in the model matches “${typed}”.`
          : 'Names, types and values of all blocks, in every subsystem.'
      }
      items={matches.map(({ inside, name, title, match }) => ({
        key: [...inside, name].join('/'),
        title: name,
        note: [title, match, inside.length ? `in ${inside.join(' › ')}` : ''].filter(Boolean).join(' · '),
      }))}
      onPick={(index) => {
        const block = matches[index]
        if (block) void showBlock(block.inside, block.name)
      }}
    />
  )
}
