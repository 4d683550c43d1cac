import { Tooltip } from '@mantine/core'
import { IconAlertCircleFilled, IconLink } from '@tabler/icons-react'
import { Handle, type Node, type NodeProps } from '@xyflow/react'
import { memo } from 'react'
import { create } from 'zustand'
import type { Finding, SheetPort, SheetBlock } from '../protocol'
import { change } from '../store'
import { ResizeHandles } from './resize_handles'
import { nameWidth, PORT, side, WIDEST_NAME } from './sheet_layout'

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
      {block.inputs.map((spot) => (
        <Port
          key={`i${spot.name}`}
          spot={spot}
          output={false}
          finding={findings.find(({ port }) => port === spot.name)}
        />
      ))}
      {block.outputs.map((spot) => (
        <Port key={`o${spot.name}`} spot={spot} output finding={undefined} />
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
  spot: SheetPort
  output: boolean
  /** The error or warning about this port. */
  finding: Finding | undefined
}

function Port({ spot, output, finding }: PortProps) {
  const marked = finding && (finding.severity === 'error' ? 'faulty' : 'unconnected')
  const about = `${spot.name}: ${spot.doc}${spot.unit && `, ${spot.unit}`}`
  return (
    <Handle
      id={spot.name}
      type={output ? 'source' : 'target'}
      position={side(spot, output)}
      className={marked ? `port ${marked}` : 'port'}
      style={{
        left: spot.x - PORT / 2,
        top: spot.y - PORT / 2,
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
  const done = (name: string) => {
    close()
    if (name && name !== block.name) void change({ kind: 'rename', block: block.name, name })
  }
  if (!editing)
    return (
      <div
        className={`name ${block.name_at}${nameWidth(block.name) < WIDEST_NAME ? '' : ' long'}`}
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
      className={`name nodrag ${block.name_at}`}
      aria-label={`Name of ${block.name}`}
      autoFocus
      defaultValue={block.name}
      onFocus={(event) => event.target.select()}
      onBlur={(event) => done(event.target.value.trim())}
      onKeyDown={(event) => {
        event.stopPropagation()
        if (event.key === 'Enter') event.currentTarget.blur()
        if (event.key === 'Escape') close()
      }}
    />
  )
}
