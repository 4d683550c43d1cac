import { Anchor, Breadcrumbs, useComputedColorScheme } from '@mantine/core'
import { IconLink } from '@tabler/icons-react'
import {
  Background,
  BackgroundVariant,
  ConnectionLineType,
  Controls,
  ReactFlow,
  ReactFlowProvider,
  ViewportPortal,
  useReactFlow,
  type EdgeChange,
  type NodeChange,
} from '@xyflow/react'
import { useRef, useState } from 'react'
import { deferred } from '../deferred'
import { showDialog } from '../dialogs'
import type { Edit } from '../messages'
import type { Places } from '../model/wires'
import type { OuterComment } from '../protocol'
import { isByTab } from '../sheet_focus'
import { alteration, ask, openSheet, useStudio } from '../store'
import { sheetKey } from '../documents/document_views'
import { selectedBlocks } from './arranging'
import { BlockNode } from './block_node'
import { useClicks } from './clicks'
import { connect, endConnection, isConnectable, startConnection } from './connecting'
import { DragPreview, useDraggedCopies } from './drag_preview'
import { GRID } from './insert'
import { NoteNode } from './note_node'
import { usePointerDrags } from './pointer_buttons'
import { openBlock } from './sheet_actions'
import { dragHandlers, dropHandlers, useSheetDrag, type SheetDrag } from './sheet_drag'
import { useSheetDrawing } from './sheet_drawing'
import type { SheetGraph, SheetNode } from './sheet_graph'
import { useSheetKeys } from './sheet_keys'
import { FIT } from './sheet_layout'
import { MotionContext } from './sheet_motion'
import { useCentredBlock, useView } from './sheet_view'
import { SignalNames } from './signal_names'
import { useStableHandlers } from './stable_handlers'
import { Welcome } from './welcome'
import { WireEdge, type WireEdgeType } from './wire_edge'

const ArrangeBar = deferred(async () => (await import('./arrange_bar')).ArrangeBar)
const ProposedLine = deferred(async () => (await import('./proposed_line')).ProposedLine)
const WireValues = deferred(async () => (await import('../run/wire_values')).WireValues)
const LargeSheet = deferred(async () => (await import('./large_sheet')).LargeSheet)
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
              onClick={() => openSheet(inside.slice(0, depth))}
            >
              {name}
            </Anchor>
          ))}
        </Breadcrumbs>
      )}
      {document.linked.length > 0 && <LibraryNote link={document.link} linked={document.linked} />}
      {document.outerComment && <CommentNote {...document.outerComment} />}
      <ReactFlowProvider key={sheetKey(state.document, inside)}>
        <Sheet sheetKey={sheetKey(state.document, inside)} />
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

/** Notice that a sheet is inside a commented subsystem, with a button that removes the comment. */
function CommentNote({ path, comment }: OuterComment) {
  return (
    <div className="library-note comment-note">
      <span>
        <b>{path.join(' › ')}</b> is commented {comment}: this sheet is not part of the model.
      </span>
      <Anchor component="button" size="sm" onClick={() => void uncomment(path)}>
        Uncomment
      </Anchor>
    </div>
  )
}

async function uncomment(path: string[]): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  const edit: Edit = { kind: 'comment', blocks: path.slice(-1), comment: '' }
  await ask({ kind: 'change', ...alteration(document.state), inside: path.slice(0, -1), edit })
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
  openSheet(document.inside)
}

function Sheet({ sheetKey }: { sheetKey: string }) {
  const blocks = useStudio((s) => s.document!.blocks)
  const wires = useStudio((s) => s.document!.wires)
  const notes = useStudio((s) => s.document!.notes)
  const scheme = useComputedColorScheme('light')
  const severalSelected = useStudio(() => selectedBlocks().length > 1)
  const flow = useReactFlow<SheetNode, WireEdgeType>()
  const sheet = useRef<HTMLDivElement>(null)
  const [selectedWires, setSelectedWires] = useState<ReadonlySet<string>>(new Set())
  const sheetDrag = useSheetDrag(blocks, notes)
  const { graph, nodes, edges, lines } = useSheetDrawing(sheetDrag, selectedWires)
  const { press, notePress, ...clicks } = useClicks(selectedWires, setSelectedWires)
  useCentredBlock(flow, blocks)
  useSheetKeys(selectedWires, setSelectedWires)
  const empty = Object.keys(blocks).length === 0 && Object.keys(notes).length === 0
  const { view, motion } = useView(sheet, flow, sheetKey, blocks, empty)
  const handlers = useStableHandlers({
    onNodesChange: (changes: NodeChange<SheetNode>[]) => nodesChanged(changes, graph, sheetDrag),
    onEdgesChange: (changes: EdgeChange<WireEdgeType>[]) =>
      setSelectedWires(selectionAfter(changes, selectedWires)),
    ...dragHandlers({ ...sheetDrag, press }, blocks, notes, wires, edges, flow.getZoom),
    ...clicks,
    onNodeDoubleClick: (_: unknown, node: SheetNode) => node.type === 'block' && openBlock(node.data.block),
    onConnectStart: startConnection,
    onConnect: connect,
    onConnectEnd: endConnection,
  })
  const pointer = usePointerDrags(flow, edges, notePress, setSelectedWires)
  const selectedEdge = selectedWires.size === 1 ? edges.find(({ selected }) => selected) : undefined
  return (
    <div
      className="canvas"
      ref={sheet}
      onFocus={selectFocused}
      {...dropHandlers(sheetDrag.setTargetWire, flow, wires, edges)}
      {...pointer}
    >
      <ArrowMarkers />
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
        isValidConnection={isConnectable}
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
        {...view}
        fitViewOptions={FIT}
        elevateNodesOnSelect={false}
        aria-label="Diagram"
      >
        <Background variant={BackgroundVariant.Dots} gap={20} size={1} />
        {!empty && <Controls showInteractive={false} fitViewOptions={FIT} />}
        <DragPreview />
        <Proposal />
        <WireValues selectedEdge={selectedEdge} lines={lines} />
        <SignalNames lines={lines} />
        <MotionContext value={motion}>{motion.isLarge && <LargeSheet />}</MotionContext>
      </ReactFlow>
      {severalSelected && <ArrangeBar />}
      {empty && <EmptySheet />}
    </div>
  )
}

/** The proposed wire, in the coordinates of the sheet. */
function Proposal() {
  return (
    <ViewportPortal>
      <ProposedLine />
    </ViewportPortal>
  )
}

/** The first steps on an empty sheet. */
function EmptySheet() {
  const level = useStudio((s) => s.document!.inside.length)
  if (level === 0) return <Welcome />
  return <p className="empty over">The subsystem is empty: type to add a block, such as In or Out.</p>
}

/** Select the block that receives the focus by Tab. */
function selectFocused({ target }: React.FocusEvent): void {
  const name =
    isByTab() && target.classList.contains('react-flow__node') && target.matches(':focus-visible')
      ? target.getAttribute('data-id')
      : null
  if (name) useStudio.getState().select([name])
}

/** A double click on the empty sheet: choose a block by name and insert it there. */
function insertAt(event: React.MouseEvent): void {
  if ((event.target as Element).classList.contains('react-flow__pane'))
    showDialog('insert', '', { x: event.clientX, y: event.clientY })
}

/** Show copies of blocks at the dragged positions; the blocks themselves are not moved. */
function showCopies(names: readonly string[], places: Places): void {
  const { document } = useStudio.getState()
  const first = names.find((name) => places[name])
  const original = document?.blocks[first!]?.place ?? document?.notes[first!]
  if (!original) return
  const { x, y } = places[first!]!
  useDraggedCopies.setState({ names, shift: [x - original.x, y - original.y] })
}

function nodesChanged(
  changes: NodeChange<SheetNode>[],
  graph: SheetGraph,
  { setDrag, effect }: SheetDrag,
): void {
  const places: Places = {}
  let selected: Set<string> | null = null
  for (const nodeChange of changes) {
    if (nodeChange.type === 'position' && nodeChange.position) places[nodeChange.id] = nodeChange.position
    else if (nodeChange.type === 'select') {
      selected ??= new Set(useStudio.getState().selection)
      if (nodeChange.selected) selected.add(nodeChange.id)
      else selected.delete(nodeChange.id)
    } else if (nodeChange.type === 'dimensions' && nodeChange.dimensions)
      graph.measured.set(nodeChange.id, nodeChange.dimensions)
  }
  const names = effect.current.cancelled ? [] : Object.keys(places)
  if (names.length && effect.current.duplicated) showCopies(effect.current.duplicated, places)
  else if (names.length) setDrag((now) => ({ ...now, ...places }))
  if (selected) useStudio.getState().select(selected)
}

/** The selected wires after a selection change. */
function selectionAfter(
  changes: EdgeChange<WireEdgeType>[],
  previous: ReadonlySet<string>,
): ReadonlySet<string> {
  const selected = new Set(previous)
  for (const edgeChange of changes) {
    if (edgeChange.type !== 'select') continue
    if (edgeChange.selected) selected.add(edgeChange.id)
    else selected.delete(edgeChange.id)
  }
  return selected
}

const ARROW_MARKERS = [
  ['wire-head', 'f-wire'],
  ['selected-wire-head', 'f-accent'],
] as const

/** The arrow heads that all wires share. */
function ArrowMarkers() {
  return (
    <svg className="defs" width="0" height="0" aria-hidden>
      {ARROW_MARKERS.map(([id, tone]) => (
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
