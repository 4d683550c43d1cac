import { Tooltip } from '@mantine/core'
import { IconAlertCircleFilled, IconLink } from '@tabler/icons-react'
import { Handle, type Node, type NodeProps } from '@xyflow/react'
import { memo } from 'react'
import { create } from 'zustand'
import { isCommandKey } from '../model/field_keys'
import type { Finding, SheetPort, SheetBlock } from '../protocol'
import { returnFocus } from '../sheet_focus'
import { change } from '../store'
import { ResizeHandles } from './resize_handles'
import { nameWidth, PORT, portSide, MAX_NAME_WIDTH } from './sheet_layout'

export type BlockNodeType = Node<{ block: SheetBlock; findings: Finding[] }, 'block'>

/** The block whose name is being edited. */
const useRenaming = create<{ name: string | null }>(() => ({ name: null }))

/** Edit the name of a block in place. */
export const rename = (name: string): void => useRenaming.setState({ name })

/** A block: its drawing from the server, its ports, its name, and its errors. */
export const BlockNode = memo(function BlockNode({
  data: { block, findings },
  selected,
}: NodeProps<BlockNodeType>) {
  const errors = findings.filter(({ severity }) => severity === 'error')
  return (
    <div
      className={selected ? 'block selected' : 'block'}
      style={{ width: block.width, height: block.height }}
      title={block.title}
    >
      <svg
        className="face"
        width={block.width}
        height={block.height}
        aria-hidden
        dangerouslySetInnerHTML={{ __html: block.face }}
      />
      {block.inputs.map((port) => (
        <Port
          key={`i${port.name}`}
          port={port}
          output={false}
          finding={findings.find((finding) => finding.port === port.name)}
        />
      ))}
      {block.outputs.map((port) => (
        <Port key={`o${port.name}`} port={port} output finding={undefined} />
      ))}
      {block.link && <IconLink className="link" size={13} aria-label={`linked to ${block.link}`} />}
      <Name block={block} />
      {selected && <ResizeHandles block={block} />}
      {errors.length > 0 && (
        <Tooltip
          multiline
          w={280}
          label={errors.map(({ what, fix }) => (
            <span key={what}>
              {what}
              {fix && ` — ${fix}`}
              <br />
            </span>
          ))}
        >
          <IconAlertCircleFilled
            className="fault"
            size={16}
            aria-label={errors.map(({ what }) => what).join('; ')}
          />
        </Tooltip>
      )}
    </div>
  )
})

interface PortProps {
  port: SheetPort
  output: boolean
  /** The error or warning about this port. */
  finding: Finding | undefined
}

function Port({ port, output, finding }: PortProps) {
  const marked = finding && (finding.severity === 'error' ? 'faulty' : 'unconnected')
  const about = `${port.name}: ${port.doc}${port.unit && `, ${port.unit}`}`
  return (
    <Handle
      id={port.name}
      type={output ? 'source' : 'target'}
      position={portSide(port, output)}
      className={marked ? `port ${marked}` : 'port'}
      style={{
        left: port.x - PORT / 2,
        top: port.y - PORT / 2,
        right: 'auto',
        bottom: 'auto',
        transform: 'none',
      }}
      title={marked === 'unconnected' ? `${about} (${finding!.what})` : about}
    />
  )
}

/** The block's name; a double click edits it in place. */
function Name({ block }: { block: SheetBlock }) {
  const editing = useRenaming((s) => s.name === block.name)
  const close = () => useRenaming.setState({ name: null })
  const done = async (name: string) => {
    close()
    if (!name || name === block.name) return
    const version = await change({ kind: 'rename', block: block.name, name })
    returnFocus(version === undefined ? block.name : name)
  }
  if (!editing)
    return (
      <div
        className={`name ${block.shown_name_side}${nameWidth(block.name) < MAX_NAME_WIDTH ? '' : ' long'}`}
        onDoubleClick={(event) => {
          event.stopPropagation()
          rename(block.name)
        }}
      >
        {block.name}
      </div>
    )
  return (
    <input
      className={`name nodrag ${block.shown_name_side}`}
      aria-label={`Name of ${block.name}`}
      autoFocus
      defaultValue={block.name}
      onFocus={(event) => event.target.select()}
      onBlur={(event) => void done(event.target.value.trim())}
      onKeyDown={(event) => {
        if (!isCommandKey(event)) event.stopPropagation()
        if (event.key === 'Enter') event.currentTarget.blur()
        if (event.key === 'Escape') close()
        if (event.key === 'Enter' || event.key === 'Escape') returnFocus(block.name)
      }}
    />
  )
}
