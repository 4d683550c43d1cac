import { useMemo } from 'react'
import { addBlock, insertBlock, placeAt } from '../canvas/insert'
import { show, useDialogs } from '../dialogs'
import { useStudio } from '../store'
import { Face } from './palette'
import { PickList } from './pick_list'
import { matching } from './search'

const MOST_SHOWN = 8

/** Adds a block by keyboard alone: type a few letters, press Enter. */
export function QuickInsert() {
  const opened = useDialogs((s) => s.open === 'insert')
  const typed = useDialogs((s) => s.typed)
  const at = useDialogs((s) => s.at)
  const library = useStudio((s) => s.welcome?.library)
  const end = useDialogs((s) => s.end)
  const found = useMemo(() => {
    const fitting = (library ?? []).filter(
      ({ inputs, outputs }) => !end || (end.isOutput ? inputs : outputs).length > 0,
    )
    return matching(fitting, typed).slice(0, MOST_SHOWN)
  }, [library, typed, end])
  return (
    <PickList
      opened={opened}
      onClose={() => show(null)}
      label="Add a block"
      placeholder="Add a block: type its name"
      list="Blocks"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      nothing={`No block matches “${typed}”.`}
      items={found.map((kind) => ({
        key: kind.type,
        face: <Face kind={kind} />,
        title: kind.title,
        note: kind.summary,
      }))}
      onPick={(index) => {
        const kind = found[index]
        if (kind && at) void insertBlock(kind.type, placeAt(at), end ? { end } : {})
        else if (kind) addBlock(kind)
      }}
    />
  )
}
