import type { Connection, Edge, FinalConnectionState } from '@xyflow/react'
import { showDialog } from '../dialogs'
import { freePort } from '../model/free_port'
import { blockOf, isFrame, mixedKinds, portOf, sameKind, wireKey } from '../model/wires'
import type { Wire } from '../protocol'
import { change, refuse, useStudio } from '../store'
import { onEscape } from './pointer_drag'

/** Removes the listener for Escape, which cancels the drag from a port. */
let escape = new AbortController()
let cancelled = false

/** Handle the start of a drag from a port. */
export function startConnection(): void {
  escape.abort()
  escape = new AbortController()
  cancelled = false
  onEscape(() => {
    cancelled = true
    // React Flow ends a drag only at the release of the button.
    document.dispatchEvent(new MouseEvent('mouseup'))
  }, escape.signal)
}

/** Whether a dragged wire may end at a port: frame lines and wires of signals do not mix. */
export const isConnectable = (wire: Connection | Edge): boolean =>
  sameKind(
    useStudio.getState().document?.blocks ?? {},
    `${wire.source}/${wire.sourceHandle}`,
    `${wire.target}/${wire.targetHandle}`,
  )

/** Handle the end of a drag from a port at another port. */
export function connect({ source, sourceHandle, target, targetHandle }: Connection): void {
  if (!cancelled && sourceHandle && targetHandle)
    void change({
      kind: 'connect',
      wire: { source: `${source}/${sourceHandle}`, target: `${target}/${targetHandle}` },
    })
}

/** Handle the end of a drag from a port, unless it ends at another port. */
export function endConnection(event: MouseEvent | TouchEvent, state: FinalConnectionState): void {
  const { fromHandle, fromNode, toHandle, toNode, isValid } = state
  escape.abort()
  if (!cancelled && isValid === false && fromHandle && toHandle && fromHandle.nodeId !== toHandle.nodeId)
    refuse(mixedKinds(`${fromNode?.id}/${fromHandle.id}`, `${toNode?.id}/${toHandle.id}`))
  if (cancelled || toHandle || isValid || !fromHandle?.id || !fromNode || !('clientX' in event)) return
  connectAt(
    { x: event.clientX, y: event.clientY },
    `${fromNode.id}/${fromHandle.id}`,
    fromHandle.type === 'source' && !isLeftFrame(`${fromNode.id}/${fromHandle.id}`),
  )
}

/** Whether a port is a frame port at the left side of its block: a new block is then left of it. */
function isLeftFrame(port: string): boolean {
  const found = useStudio.getState().document?.blocks[blockOf(port)]?.outputs
  return Boolean(found?.some(({ name, frame, dx }) => frame && dx < 0 && name === portOf(port)))
}

/**
 * End a new wire at a point of the window. On the body of a block, connect the wire to the first free port.
 * On the empty sheet, the list of blocks opens and the chosen block is connected. The wire replaces the wires
 * `instead`.
 */
export function connectAt(
  at: { x: number; y: number },
  port: string,
  isOutput: boolean,
  instead: Wire[] = [],
): void {
  const { document } = useStudio.getState()
  if (!document) return
  const element = window.document.elementFromPoint(at.x, at.y)
  const nodeName = element?.closest('.react-flow__node')?.getAttribute('data-id')
  if (nodeName) {
    const block = port.startsWith(`${nodeName}/`) ? undefined : document.blocks[nodeName]
    const replaced = new Set(instead.map(wireKey))
    const remaining = document.wires.filter((wire) => !replaced.has(wireKey(wire)))
    const frame = isFrame(document.blocks, port)
    const other = block && freePort(block, isOutput, remaining, frame)
    if (block && !other && freePort(block, isOutput, remaining, !frame)) refuse(mixedKinds(port, nodeName))
    const wire = isOutput ? { source: port, target: other ?? '' } : { source: other ?? '', target: port }
    if (other && !replaced.has(wireKey(wire))) void change({ kind: 'connect', wire, instead })
  } else if (element?.closest('.canvas')) showDialog('insert', '', at, { port, isOutput, instead })
}
