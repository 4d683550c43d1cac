import { useMemo } from 'react'
import { addBlock, insertBlock, sheetPointAt } from '../canvas/insert'
import { showDialog, useDialogs } from '../dialogs'
import { isFrame } from '../model/wires'
import { useStudio } from '../store'
import { Face } from './palette'
import { PickList } from './pick_list'
import { matching } from './search'

const MAX_SHOWN = 8
/** The ports of a block that is connected to a port of the sheet. */
const NEEDED = { frames: 'a frame port', inputs: 'an input', outputs: 'an output' }

/** Adds a block by keyboard alone: type a few letters, press Enter. */
export function QuickInsert() {
  const opened = useDialogs((s) => s.open === 'insert')
  const typed = useDialogs((s) => s.typed)
  const at = useDialogs((s) => s.at)
  const library = useStudio((s) => s.welcome?.library)
  const connectTo = useDialogs((s) => s.connectTo)
  const blocks = useStudio((s) => s.document?.blocks)
  const needed = !connectTo
    ? null
    : isFrame(blocks ?? {}, connectTo.port)
      ? 'frames'
      : connectTo.isOutput
        ? 'inputs'
        : 'outputs'
  const matches = useMemo(() => {
    const connectable = (library ?? []).filter((blockType) => !needed || blockType[needed].length > 0)
    return matching(connectable, typed).slice(0, MAX_SHOWN)
  }, [library, typed, needed])
  return (
    <PickList
      opened={opened}
      onClose={() => showDialog(null)}
      label="Add a block"
      placeholder="Add a block: type its name"
      list="Blocks"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      emptyText={`No block${needed ? ` with ${NEEDED[needed]}` : ''} matches “${typed}”.`}
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
