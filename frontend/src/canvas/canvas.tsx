import { Anchor, Breadcrumbs, useComputedColorScheme } from '@mantine/core'
import { IconLink } from '@tabler/icons-react'
import {
  Background,
  BackgroundVariant,
  ConnectionLineType,
  Controls,
  ReactFlow,
  ReactFlowProvider,
  useReactFlow,
  type Connection,
  type EdgeChange,
  type NodeChange,
} from '@xyflow/react'
import { useRef, useState } from 'react'
import { show } from '../dialogs'
import type { Places } from '../model/wires'
import { WireValues } from '../run/wire_values'
import { ask, change, look, useStudio } from '../store'
import { ArrangeBar } from './arrange_bar'
import { BlockNode } from './block_node'
import { connectedTo } from './connecting'
import { DragPreview, useCopies } from './copying'
import { GRID } from './insert'
import { NoteNode } from './note_node'
import { Overview } from './overview'
import { useRightButton } from './right_button'
import { openBlock } from './sheet_actions'
import { dragHandlers, dropHandlers, useSheetDrag, type SheetDrag } from './sheet_drag'
import { useSheetDrawing } from './sheet_drawing'
import type { SheetGraph, SheetNode } from './sheet_graph'
import { useSheetKeys } from './sheet_keys'
import { FIT } from './sheet_layout'
import { useFitted, useNameScale, useSheetView, useSought } from './sheet_view'
import { SignalNames } from './signal_names'
import { useSteady } from './steady'
import { Welcome } from './welcome'
import { WireEdge, type WireEdgeType } from './wire_edge'

const nodeTypes = { block: BlockNode, note: NoteNode }
const edgeTypes = { wire: WireEdge }
const SNAP: [number, number] = [GRID, GRID]
const PANNING_BUTTONS = [1, 2]

export function Canvas() {
  const document = useStudio((s) => s.document)
  if (!document) return <p className="empty">Opening …</p>
  const { state, inside } = document
  return (
    <div className="sheet">
      {inside.length > 0 && (
        <Breadcrumbs className="breadcrumbs" separator="›" aria-label="Subsystems">
          {[state.title, ...inside].map((name, depth) => (
            <Anchor
              key={`${depth} ${name}`}
              component="button"
              size="sm"
              onClick={() => look(inside.slice(0, depth))}
            >
              {name}
            </Anchor>
          ))}
        </Breadcrumbs>
      )}
      {document.linked.length > 0 && <LibraryNote link={document.link} linked={document.linked} />}
      <ReactFlowProvider key={[state.document, ...inside].join('/')}>
        <Sheet />
      </ReactFlowProvider>
    </div>
  )
}

/** Notice that a sheet belongs to a library, with a button that breaks the link. */
function LibraryNote({ link, linked }: { link: string; linked: string[] }) {
  return (
    <div className="library-note">
      <IconLink size={14} aria-hidden />
      <span>
        <b>{linked.join(' › ')}</b> is {link.split('/').at(-1)} of a library and cannot be changed here.
      </span>
      <Anchor component="button" size="sm" onClick={() => void breakLink(linked)}>
        Break the link
      </Anchor>
    </div>
  )
}

/** Break the library link of the block at this path, and reload the sheet. */
async function breakLink(linked: string[]): Promise<void> {
  const { document } = useStudio.getState()
  const block = linked.at(-1)
  if (!document || !block) return
  await ask({
    kind: 'change',
    document: document.state.document,
    key: crypto.randomUUID(),
    inside: linked.slice(0, -1),
    edit: { kind: 'break_link', block },
  })
  look(document.inside)
}

function Sheet() {
  const blocks = useStudio((s) => s.document!.blocks)
  const wires = useStudio((s) => s.document!.wires)
  const notes = useStudio((s) => s.document!.notes)
  const scheme = useComputedColorScheme('light')
  const flow = useReactFlow<SheetNode, WireEdgeType>()
  const sheet = useRef<HTMLDivElement>(null)
  const [chosenWires, setChosenWires] = useState<ReadonlySet<string>>(new Set())
  const mouse = useSheetDrag(blocks, notes)
  const { graph, nodes, edges, lines } = useSheetDrawing(mouse, chosenWires)
  useSought(sheet, flow, blocks)
  useSheetKeys(sheet, chosenWires, setChosenWires)
  useSheetView(sheet, flow)
  useNameScale(sheet)
  useFitted(sheet, flow)
  const handlers = useSteady({
    onNodesChange: (changes: NodeChange<SheetNode>[]) => nodesChanged(changes, graph, mouse),
    onEdgesChange: (changes: EdgeChange<WireEdgeType>[]) => setChosenWires(chosenAfter(changes, chosenWires)),
    ...dragHandlers(mouse, blocks, notes, wires, edges, flow.getZoom),
    onNodeClick: (event: React.MouseEvent, node: SheetNode) => {
      if (!chooseAlone(event, node.id)) return
      setChosenWires(new Set())
    },
    onNodeDoubleClick: (_: unknown, node: SheetNode) => node.type === 'block' && openBlock(node.data.block),
    onConnect: connect,
    onConnectEnd: connectedTo,
  })
  const right = useRightButton(flow, edges, setChosenWires)
  const chosenEdge = chosenWires.size === 1 ? edges.find(({ selected }) => selected) : undefined
  const empty = Object.keys(blocks).length === 0 && Object.keys(notes).length === 0
  // An empty sheet would be fitted to the first block that is dropped on it, which would then jump.
  const [begunWithBlocks] = useState(!empty)
  return (
    <div
      className="canvas"
      ref={sheet}
      onFocus={selectFocused}
      {...dropHandlers(mouse.setInto, flow, wires, edges)}
      {...right}
    >
      <WireHead />
      <ReactFlow<SheetNode, WireEdgeType>
        nodes={nodes}
        edges={edges}
        nodeTypes={nodeTypes}
        edgeTypes={edgeTypes}
        colorMode={scheme}
        {...handlers}
        onDoubleClick={insertAt}
        zoomOnDoubleClick={false}
        connectionLineType={ConnectionLineType.Step}
        connectionRadius={24}
        deleteKeyCode={null}
        disableKeyboardA11y
        snapToGrid
        snapGrid={SNAP}
        selectionOnDrag
        selectionKeyCode={null}
        panOnDrag={PANNING_BUTTONS}
        panOnScroll
        zoomOnPinch
        minZoom={0.1}
        maxZoom={4}
        fitView={begunWithBlocks}
        fitViewOptions={FIT}
        elevateNodesOnSelect={false}
        aria-label="Diagram"
      >
        <Background variant={BackgroundVariant.Dots} gap={20} size={1} />
        {!empty && <Controls showInteractive={false} fitViewOptions={FIT} />}
        <DragPreview />
        <WireValues chosen={chosenEdge} />
        <SignalNames lines={lines} />
        {Object.keys(blocks).length > 40 && <Overview blocks={blocks} />}
      </ReactFlow>
      <ArrangeBar />
      {empty && <EmptySheet />}
    </div>
  )
}

/** The first steps on an empty sheet. */
function EmptySheet() {
  const level = useStudio((s) => s.document!.inside.length)
  if (level === 0) return <Welcome />
  return <p className="empty over">Nothing is inside yet: type to add a block, such as In and Out.</p>
}

/** Moving through the blocks with Tab selects the focused one. */
function selectFocused({ target }: React.FocusEvent): void {
  const name =
    target.classList.contains('react-flow__node') && target.matches(':focus-visible')
      ? target.getAttribute('data-id')
      : null
  if (name) useStudio.getState().select([name])
}

/** A double click on the empty sheet: choose a block by name and insert it there. */
function insertAt(event: React.MouseEvent): void {
  if ((event.target as Element).classList.contains('react-flow__pane'))
    show('insert', '', { x: event.clientX, y: event.clientY })
}

/** A click on one of several selected blocks selects it alone; whether it has changed the selection. */
function chooseAlone({ ctrlKey, metaKey, shiftKey }: React.MouseEvent, id: string): boolean {
  const { selection, select } = useStudio.getState()
  if (ctrlKey || metaKey || shiftKey || selection.size < 2) return false
  select([id])
  return true
}

function connect({ source, sourceHandle, target, targetHandle }: Connection): void {
  if (sourceHandle && targetHandle)
    void change({
      kind: 'connect',
      wire: { source: `${source}/${sourceHandle}`, target: `${target}/${targetHandle}` },
    })
}

/** Show the copies of dragged blocks at their positions; the blocks themselves remain. */
function showCopies(places: Places): void {
  const { document } = useStudio.getState()
  const [first] = Object.keys(places)
  const from = document?.blocks[first!]?.place ?? document?.notes[first!]
  if (!from) return
  const { x, y } = places[first!]!
  useCopies.setState({ names: Object.keys(places), shift: [x - from.x, y - from.y] })
}

function nodesChanged(
  changes: NodeChange<SheetNode>[],
  graph: SheetGraph,
  { setDrag, held }: SheetDrag,
): void {
  const places: Places = {}
  let chosen: Set<string> | null = null
  for (const one of changes) {
    if (one.type === 'position' && one.position) places[one.id] = one.position
    else if (one.type === 'select') {
      chosen ??= new Set(useStudio.getState().selection)
      if (one.selected) chosen.add(one.id)
      else chosen.delete(one.id)
    } else if (one.type === 'dimensions' && one.dimensions) graph.measured.set(one.id, one.dimensions)
  }
  const names = Object.keys(places)
  if (names.length && held.current.copies) showCopies(places)
  else if (names.length) setDrag((now) => ({ ...now, ...places }))
  if (chosen) useStudio.getState().select(chosen)
}

/** The selected wires after a selection change. */
function chosenAfter(changes: EdgeChange<WireEdgeType>[], before: ReadonlySet<string>): ReadonlySet<string> {
  const chosen = new Set(before)
  for (const one of changes) {
    if (one.type !== 'select') continue
    if (one.selected) chosen.add(one.id)
    else chosen.delete(one.id)
  }
  return chosen
}

const WIRE_HEADS = [
  ['wire-head', 'f-wire'],
  ['selected-wire-head', 'f-accent'],
] as const

/** The arrow heads that all wires share. */
function WireHead() {
  return (
    <svg className="defs" width="0" height="0" aria-hidden>
      {WIRE_HEADS.map(([id, tone]) => (
        <marker
          key={id}
          id={id}
          viewBox="0 0 8 8"
          refX="8"
          refY="4"
          markerWidth="8"
          markerHeight="8"
          markerUnits="userSpaceOnUse"
          orient="auto"
        >
          <path d="M0 0.300L8 4L0 7.700Z" className={tone} />
        </marker>
      ))}
    </svg>
  )
}
