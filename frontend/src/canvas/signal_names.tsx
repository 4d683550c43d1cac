import { ViewportPortal } from '@xyflow/react'
import { create } from 'zustand'
import { isCommandKey } from '../model/field_keys'
import type { Lines } from '../model/wire_lines'
import { blockOf, portOf } from '../model/wires'
import type { SheetBlock, WireLines } from '../protocol'
import { returnFocus } from '../sheet_focus'
import { change, useStudio } from '../store'

/** The output whose signal is being named. */
const useEditedName = create<{ port: string | null }>(() => ({ port: null }))

/** Edit the name of the signal at an output, `block/port`, on the sheet. */
export const nameSignal = (port: string): void => useEditedName.setState({ port })

/** The names of the signals of the sheet, on their lines; a double click edits a name. */
export function SignalNames({ lines }: { lines: Lines }) {
  const blocks = useStudio((s) => s.document!.blocks)
  const editedPort = useEditedName((s) => s.port)
  const namedLines = Object.entries(lines).filter(
    ([port, net]) => port === editedPort || Boolean(net.name_at && shownName(net)),
  )
  return (
    <ViewportPortal>
      {namedLines.map(([port, net]) => (
        <div key={port} className="signal-name" style={{ transform: transformOf(port, net, blocks) }}>
          {port === editedPort ? (
            <NameField port={port} name={net.name ?? ''} />
          ) : (
            <span
              className={net.name ? '' : 'propagated'}
              title={`Signal of ${port}${net.name ? '' : `, named ${net.propagated_name} elsewhere`}`}
              onDoubleClick={() => nameSignal(port)}
            >
              {shownName(net)}
            </span>
          )}
        </div>
      ))}
    </ViewportPortal>
  )
}

/** The text at the line of a signal: its name, or `<name>` with its name on another sheet or at a Goto. */
export const shownName = ({ name, propagated_name }: WireLines): string =>
  name || (propagated_name ? `<${propagated_name}>` : '')

/** The position of a name: on its line, or at the output of a signal without a line. */
function transformOf(port: string, { name_at }: WireLines, blocks: Record<string, SheetBlock>): string {
  if (name_at) {
    const [x, y, anchor] = name_at
    return `translate(${x}px, ${y}px) translate(${anchor === 'middle' ? '-50%' : '0'}, -85%)`
  }
  const block = blocks[blockOf(port)]
  const output = block?.outputs.find(({ name }) => name === portOf(port))
  const [x, y] = [(block?.place.x ?? 0) + (output?.x ?? 0), (block?.place.y ?? 0) + (output?.y ?? 0)]
  return `translate(${x}px, ${y}px)`
}

function NameField({ port, name }: { port: string; name: string }) {
  const commit = (typed: string | null) => {
    useEditedName.setState({ port: null })
    if (typed !== null && typed !== name) void change({ kind: 'name_signal', port, name: typed })
  }
  return (
    <input
      className="nodrag nopan"
      aria-label={`Name of the signal of ${port}`}
      autoFocus
      defaultValue={name}
      size={Math.max(name.length, 8)}
      onFocus={(event) => event.target.select()}
      onBlur={(event) => commit(event.target.value.trim())}
      onKeyDown={(event) => {
        if (!isCommandKey(event)) event.stopPropagation()
        if (event.key === 'Enter') event.currentTarget.blur()
        if (event.key === 'Escape') commit(null)
        if (event.key === 'Enter' || event.key === 'Escape') returnFocus(blockOf(port))
      }}
    />
  )
}
