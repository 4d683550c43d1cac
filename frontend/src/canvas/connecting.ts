import type { FinalConnectionState } from '@xyflow/react'
import { show } from '../dialogs'
import { freePort } from '../model/free_port'
import { change, useStudio } from '../store'

/**
 * The end of a drag from a port. On the body of a block the wire takes its first free port. On the empty
 * sheet the list of blocks opens, and the chosen block is connected.
 */
export function connectedTo(event: MouseEvent | TouchEvent, state: FinalConnectionState): void {
  const { fromHandle, fromNode, toHandle, isValid } = state
  const { document } = useStudio.getState()
  if (toHandle || isValid || !fromHandle?.id || !fromNode || !document || !('clientX' in event)) return
  const isOutput = fromHandle.type === 'source'
  const port = `${fromNode.id}/${fromHandle.id}`
  const at = { x: event.clientX, y: event.clientY }
  const under = window.document.elementFromPoint(at.x, at.y)
  const node = under?.closest('.react-flow__node')?.getAttribute('data-id')
  if (node) {
    const block = node === fromNode.id ? undefined : document.blocks[node]
    const other = block && freePort(block, isOutput, document.wires)
    if (other)
      void change({
        kind: 'connect',
        wire: isOutput ? { source: port, target: other } : { source: other, target: port },
      })
  } else if (under?.closest('.canvas')) show('insert', '', at, { port, isOutput })
}
