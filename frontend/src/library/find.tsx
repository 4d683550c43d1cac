import { useEffect, useState } from 'react'
import { show, useDialogs } from '../dialogs'
import type { Found } from '../protocol'
import { ask, showBlock, useStudio } from '../store'
import { PickList } from './pick_list'

const WAIT_MS = 80

/** Search of all blocks of the model by name, type or parameter value; Enter shows the block. */
export function Find() {
  const opened = useDialogs((s) => s.open === 'find')
  const typed = useDialogs((s) => s.typed)
  const document = useStudio((s) => s.document?.state.document)
  const [found, setFound] = useState<Found[]>([])
  useEffect(() => {
    setFound([])
    if (!opened || !document || !typed.trim()) return
    let current = true
    const timer = setTimeout(() => {
      void ask({ kind: 'find', document, text: typed }).then((answer) => current && setFound(answer ?? []))
    }, WAIT_MS)
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, [opened, document, typed])
  return (
    <PickList
      opened={opened}
      onClose={() => show(null)}
      label="Find"
      placeholder="Find in the model: a name, a type, a value"
      list="Found"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      nothing={
        typed.trim()
          ? `Nothing in the model matches “${typed}”.`
          : 'Names, types and values of all blocks, in every subsystem.'
      }
      items={found.map(({ inside, name, title, match }) => ({
        key: [...inside, name].join('/'),
        title: name,
        note: [title, match, inside.length ? `in ${inside.join(' › ')}` : ''].filter(Boolean).join(' · '),
      }))}
      onPick={(index) => {
        const one = found[index]
        if (one) void showBlock(one.inside, one.name)
      }}
    />
  )
}
