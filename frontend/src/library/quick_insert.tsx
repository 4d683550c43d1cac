import { useMemo } from 'react'
import { addBlock, insertBlock, sheetPointAt } from '../canvas/insert'
import { showDialog, useDialogs } from '../dialogs'
import { useStudio } from '../store'
import { Face } from './palette'
import { PickList } from './pick_list'
import { matching } from './search'

const MAX_SHOWN = 8

/** Adds a block by keyboard alone: type a few letters, press Enter. */
export function QuickInsert() {
  const opened = useDialogs((s) => s.open === 'insert')
  const typed = useDialogs((s) => s.typed)
  const at = useDialogs((s) => s.at)
  const library = useStudio((s) => s.welcome?.library)
  const connectTo = useDialogs((s) => s.connectTo)
  const matches = useMemo(() => {
    const connectable = (library ?? []).filter(
      ({ inputs, outputs }) => !connectTo || (connectTo.isOutput ? inputs : outputs).length > 0,
    )
    return matching(connectable, typed).slice(0, MAX_SHOWN)
  }, [library, typed, connectTo])
  return (
    <PickList
      opened={opened}
      onClose={() => showDialog(null)}
      label="Add a block"
      placeholder="Add a block: type its name"
      list="Blocks"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      emptyText={`No block matches “${typed}”.`}
      items={matches.map((blockType) => ({
        key: blockType.type,
        face: <Face blockType={blockType} />,
        title: blockType.title,
        note: blockType.summary,
      }))}
      onPick={(index) => {
        const blockType = matches[index]
        if (blockType && at)
          void insertBlock(blockType.type, sheetPointAt(at), connectTo ? { connectTo } : {})
        else if (blockType) addBlock(blockType)
      }}
    />
  )
}
