import { ViewportPortal } from '@xyflow/react'
import { create } from 'zustand'
import type { Lines } from '../model/wire_lines'
import { blockOf, portOf } from '../model/wires'
import type { SheetBlock, WireLines } from '../protocol'
import { change, useStudio } from '../store'

/** The output whose signal is being named. */
const useNaming = create<{ port: string | null }>(() => ({ port: null }))

/** Edit the name of the signal at an output, `block/port`, on the sheet. */
export const nameSignal = (port: string): void => useNaming.setState({ port })

/** The names of the signals of the sheet, on their lines; a double click edits a name. */
export function SignalNames({ lines }: { lines: Lines }) {
  const blocks = useStudio((s) => s.document!.blocks)
  const naming = useNaming((s) => s.port)
  const shown = Object.entries(lines).filter(
    ([port, net]) => port === naming || Boolean(net.name && net.name_at),
  )
  return (
    <ViewportPortal>
      {shown.map(([port, net]) => (
        <div key={port} className="signal-name" style={{ transform: placeOf(port, net, blocks) }}>
          {port === naming ? (
            <NameField port={port} name={net.name ?? ''} />
          ) : (
            <span title={`Signal of ${port}`} onDoubleClick={() => nameSignal(port)}>
              {net.name}
            </span>
          )}
        </div>
      ))}
    </ViewportPortal>
  )
}

/** The position of a name: on its line, or at the output of a signal without a line. */
function placeOf(port: string, { name_at }: WireLines, blocks: Record<string, SheetBlock>): string {
  if (name_at) {
    const [x, y, anchor] = name_at
    return `translate(${x}px, ${y}px) translate(${anchor === 'middle' ? '-50%' : '0'}, -85%)`
  }
  const block = blocks[blockOf(port)]
  const spot = block?.outputs.find(({ name }) => name === portOf(port))
  return `translate(${(block?.place.x ?? 0) + (spot?.x ?? 0)}px, ${(block?.place.y ?? 0) + (spot?.y ?? 0)}px)`
}

function NameField({ port, name }: { port: string; name: string }) {
  const done = (typed: string | null) => {
    useNaming.setState({ port: null })
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
      onBlur={(event) => done(event.target.value.trim())}
      onKeyDown={(event) => {
        event.stopPropagation()
        if (event.key === 'Enter') event.currentTarget.blur()
        if (event.key === 'Escape') done(null)
      }}
    />
  )
}
