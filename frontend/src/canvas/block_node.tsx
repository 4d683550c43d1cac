import { Tooltip } from '@mantine/core'
import { IconAlertCircleFilled, IconLink } from '@tabler/icons-react'
import { Handle, type Node, type NodeProps } from '@xyflow/react'
import { memo, useState } from 'react'
import type { Finding, PortSpot, SheetBlock } from '../protocol'
import { change } from '../store'
import { nameSide, nameWidth, PORT, side, WIDEST_NAME } from './sheet_layout'

export type BlockNodeType = Node<{ block: SheetBlock; findings: Finding[] }, 'block'>

/** A block: its drawing from the server, its ports, its name, and its errors. */
export const BlockNode = memo(function BlockNode({
  data: { block, findings },
  selected,
}: NodeProps<BlockNodeType>) {
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
          faulty={findings.some(({ port }) => port === spot.name)}
        />
      ))}
      {block.outputs.map((spot) => (
        <Port key={`o${spot.name}`} spot={spot} output faulty={false} />
      ))}
      {block.link && <IconLink className="link" size={13} aria-label={`linked to ${block.link}`} />}
      <Name block={block} />
      {findings.length > 0 && (
        <Tooltip
          multiline
          w={280}
          label={findings.map(({ what, fix }) => (
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
            aria-label={findings.map(({ what }) => what).join('; ')}
          />
        </Tooltip>
      )}
    </div>
  )
})

function Port({ spot, output, faulty }: { spot: PortSpot; output: boolean; faulty: boolean }) {
  return (
    <Handle
      id={spot.name}
      type={output ? 'source' : 'target'}
      position={side(spot, output)}
      className={faulty ? 'port faulty' : 'port'}
      style={{
        left: spot.x - PORT / 2,
        top: spot.y - PORT / 2,
        right: 'auto',
        bottom: 'auto',
        transform: 'none',
      }}
      title={`${spot.name}: ${spot.doc}${spot.unit && `, ${spot.unit}`}`}
    />
  )
}

/** The block's name; a double click edits it in place. */
function Name({ block }: { block: SheetBlock }) {
  const [editing, setEditing] = useState(false)
  const done = (name: string) => {
    setEditing(false)
    if (name && name !== block.name) void change({ kind: 'rename', block: block.name, name })
  }
  if (!editing)
    return (
      <div
        className={`name ${nameSide(block)}${nameWidth(block.name) < WIDEST_NAME ? '' : ' long'}`}
        onDoubleClick={(event) => {
          event.stopPropagation()
          setEditing(true)
        }}
      >
        {block.name}
      </div>
    )
  return (
    <input
      className={`name nodrag ${nameSide(block)}`}
      aria-label={`Name of ${block.name}`}
      autoFocus
      defaultValue={block.name}
      onFocus={(event) => event.target.select()}
      onBlur={(event) => done(event.target.value.trim())}
      onKeyDown={(event) => {
        event.stopPropagation()
        if (event.key === 'Enter') event.currentTarget.blur()
        if (event.key === 'Escape') setEditing(false)
      }}
    />
  )
}
