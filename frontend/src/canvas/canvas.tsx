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
import { useCallback, useEffect, useMemo, useRef, useState } from 'react'
import { show } from '../dialogs'
import type { SheetBlock, Wire } from '../protocol'
import { WireValues } from '../run/wire_values'
import { ask, change, look, useStudio } from '../store'
import { ArrangeBar } from './arrange_bar'
import { BlockNode } from './block_node'
import { BLOCK_TYPE, GRID, insertBlock } from './insert'
import { NoteNode } from './note_node'
import { Overview } from './overview'
import { isLoose, levelled, putInto, rewired, takenOut, wireAt } from '../model/rewiring'
import { SheetGraph, type SheetNode } from './sheet_graph'
import { move, openBlock } from './sheet_actions'
import { useSheetKeys } from './sheet_keys'
import { FIT, SheetRoutes } from './sheet_layout'
import { wireKey, type Places } from '../model/wires'
import { useSteady } from './steady'
import { Welcome } from './welcome'
import { useBending, WireEdge, type WireEdgeType } from './wire_edge'

const nodeTypes = { block: BlockNode, note: NoteNode }
const edgeTypes = { wire: WireEdge }
const SETTLE_MS = 120
const SNAP: [number, number] = [GRID, GRID]
const PANNING_BUTTONS = [1, 2]

/** What the mouse holds: blocks that it takes out of their wires, and one without wires, which goes into a wire that it is dropped on. */
const NOTHING_HELD: { freed: readonly string[]; loose: string | null } = { freed: [], loose: null }

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

/** Says that a sheet is a library's, and gives a copy of one's own. */
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

/** Make the library block of this path one's own, and look at the sheet anew. */
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
  const findings = useStudio((s) => s.document!.findings)
  const kinds = useStudio((s) => s.document!.wireKinds)
  const level = useStudio((s) => s.document!.inside.map((name) => `${name}/`).join(''))
  const selection = useStudio((s) => s.selection)
  const select = useStudio((s) => s.select)
  const bending = useBending((s) => s.wire)
  const scheme = useComputedColorScheme('light')
  const flow = useReactFlow<SheetNode, WireEdgeType>()
  const [drag, setDrag] = useState<Places>({})
  const [chosenWires, setChosenWires] = useState<ReadonlySet<string>>(new Set())
  const [{ freed, loose }, setHeld] = useState(NOTHING_HELD)
  /** What is held, also before the next drawing knows of it. */
  const held = useRef(NOTHING_HELD)
  /** The wire that a dragged block would go into. */
  const [into, setInto] = useState<string | null>(null)
  const [{ graph, routes }] = useState(() => ({ graph: new SheetGraph(), routes: new SheetRoutes() }))

  // A place that the server has taken over needs no memory of the drag any more.
  useEffect(() => setDrag((now) => (Object.keys(now).length ? {} : now)), [blocks, notes])

  const shown = useMemo(() => {
    if (bending) return wires.map((wire) => (wireKey(wire) === wireKey(bending) ? bending : wire))
    return freed.length ? takenOut(present(blocks, freed), wires) : wires
  }, [wires, bending, freed, blocks])
  const routed = useMemo(
    () => routes.update(blocks, shown, drag, loose),
    [routes, blocks, shown, drag, loose],
  )
  const nodes = useMemo(
    () => graph.nodes(blocks, notes, findings, level, drag, selection),
    [graph, blocks, notes, findings, level, drag, selection],
  )
  const edges = useMemo(
    () => graph.edges(shown, routed, kinds, level, chosenWires, into),
    [graph, shown, routed, kinds, level, chosenWires, into],
  )

  const onNodesChange = useCallback(
    (changes: NodeChange<SheetNode>[]) => {
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
      if (Object.keys(places).length) setDrag((now) => ({ ...now, ...places }))
      if (chosen) select(chosen)
    },
    [graph, select],
  )

  const connect = useCallback(({ source, sourceHandle, target, targetHandle }: Connection) => {
    if (sourceHandle && targetHandle)
      void change({
        kind: 'connect',
        wire: { source: `${source}/${sourceHandle}`, target: `${target}/${targetHandle}` },
      })
  }, [])

  const drop = useCallback(
    (event: React.DragEvent) => {
      const type = event.dataTransfer.getData(BLOCK_TYPE)
      if (!type) return
      event.preventDefault()
      const at = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false })
      const found = wireAt(at, edges, wires)
      setInto(null)
      if (found) insertBlock(type, { x: at.x, y: found.y }, found.wire)
      else insertBlock(type, at)
    },
    [flow, edges, wires],
  )

  const takeHold = (event: MouseEvent | TouchEvent | React.MouseEvent, _: SheetNode, nodes: SheetNode[]) => {
    const taken = present(
      blocks,
      nodes.map(({ id }) => id),
    )
    const freed = event.shiftKey || event.altKey ? taken.map(({ name }) => name) : []
    const [one] = taken
    const alone = taken.length === 1 && one && isLoose(one, freed.length ? takenOut(taken, wires) : wires)
    if (freed.length || alone) setHeld((held.current = { freed, loose: alone ? one.name : null }))
  }
  const carry = (_: unknown, node: SheetNode) => {
    const block = node.id === held.current.loose ? blocks[node.id] : undefined
    if (block) setInto(keyOf(wireAt(middleOf(block, node.position), edges, wires)?.wire))
  }
  const letGo = (_: unknown, node: SheetNode, moved: SheetNode[]) => {
    const to: Places = Object.fromEntries(moved.map(({ id, position }) => [id, position]))
    const { freed, loose } = held.current
    held.current = NOTHING_HELD
    const left = freed.length ? takenOut(present(blocks, freed), wires) : wires
    const block = loose === null ? undefined : blocks[loose]
    const found = block && wireAt(middleOf(block, node.position), edges, wires)
    if (found) to[block.name] = levelled(block, node.position, found)
    const after = found ? putInto(block, found.wire, left) : left
    // The wires stay as they are drawn until the server has them so.
    void move(to, freed.length || found ? rewired(wires, after) : undefined).finally(() =>
      setHeld((now) => (now === held.current ? now : NOTHING_HELD)),
    )
    setInto(null)
  }
  const hover = (event: React.DragEvent) => {
    event.preventDefault()
    if (!event.dataTransfer.types.includes(BLOCK_TYPE)) return
    setInto(
      keyOf(
        wireAt(
          flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }, { snapToGrid: false }),
          edges,
          wires,
        )?.wire,
      ),
    )
  }

  const sheet = useRef<HTMLDivElement>(null)
  const sought = useStudio((s) => s.sought)
  useEffect(() => {
    const block = sought === null ? undefined : blocks[sought]
    if (!block) return
    useStudio.setState({ sought: null })
    const { place, width, height } = block
    // After the sheet has fitted itself into the window, where it has just been opened.
    setTimeout(() => {
      void flow.setCenter(place.x + width / 2, place.y + height / 2, {
        zoom: Math.max(flow.getZoom(), 0.8),
        duration: 150,
      })
      sheet.current
        ?.querySelector<HTMLElement>(`.react-flow__node[data-id="${CSS.escape(block.name)}"]`)
        ?.focus({ preventScroll: true })
    }, 2 * SETTLE_MS)
  }, [sought, blocks, flow])

  useSheetKeys(sheet, flow, chosenWires, setChosenWires)
  // The sheet fits its panel, whatever size that takes, until somebody moves it.
  useEffect(() => {
    const element = sheet.current
    if (!element) return
    let timer = 0
    const sized = new ResizeObserver(() => {
      clearTimeout(timer)
      timer = window.setTimeout(() => void flow.fitView(FIT), SETTLE_MS)
    })
    const leave = () => {
      clearTimeout(timer)
      sized.disconnect()
    }
    sized.observe(element)
    for (const kind of ['pointerdown', 'wheel', 'keydown'])
      element.addEventListener(kind, leave, { once: true })
    return leave
  }, [flow])

  const handlers = useSteady({
    onNodesChange,
    onEdgesChange: (changes: EdgeChange<WireEdgeType>[]) => {
      const chosen = new Set(chosenWires)
      for (const one of changes) {
        if (one.type !== 'select') continue
        if (one.selected) chosen.add(one.id)
        else chosen.delete(one.id)
      }
      setChosenWires(chosen)
    },
    onNodeDragStart: takeHold,
    onNodeDrag: carry,
    onNodeDragStop: letGo,
    onNodeDoubleClick: (_: unknown, node: SheetNode) => node.type === 'block' && openBlock(node.data.block),
    onConnect: connect,
  })
  const chosenEdge = chosenWires.size === 1 ? edges.find(({ selected }) => selected) : undefined
  const empty = Object.keys(blocks).length === 0 && Object.keys(notes).length === 0
  return (
    <div
      className="canvas"
      ref={sheet}
      onFocus={selectFocused}
      onDragOver={hover}
      onDragLeave={() => setInto(null)}
      onDrop={drop}
    >
      <svg className="defs" width="0" height="0" aria-hidden>
        <marker
          id="wire-head"
          viewBox="0 0 8 8"
          refX="8"
          refY="4"
          markerWidth="8"
          markerHeight="8"
          markerUnits="userSpaceOnUse"
          orient="auto"
        >
          <path d="M0 0.300L8 4L0 7.700Z" className="f-wire" />
        </marker>
      </svg>
      <ReactFlow<SheetNode, WireEdgeType>
        nodes={nodes}
        edges={edges}
        nodeTypes={nodeTypes}
        edgeTypes={edgeTypes}
        colorMode={scheme}
        {...handlers}
        onDoubleClick={(event) => {
          if ((event.target as Element).classList.contains('react-flow__pane'))
            show('insert', '', { x: event.clientX, y: event.clientY })
        }}
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
        fitView
        fitViewOptions={FIT}
        aria-label="Diagram"
      >
        <Background variant={BackgroundVariant.Dots} gap={20} size={1} />
        {!empty && <Controls showInteractive={false} fitViewOptions={FIT} />}
        <WireValues chosen={chosenEdge} />
        {Object.keys(blocks).length > 40 && <Overview blocks={blocks} />}
      </ReactFlow>
      <ArrangeBar />
      {empty && level === '' && <Welcome />}
      {empty && level !== '' && (
        <p className="empty over">Nothing is inside yet: type to add a block, such as In and Out.</p>
      )}
    </div>
  )
}

/** Going through the blocks with Tab selects the one that has the focus. */
function selectFocused({ target }: React.FocusEvent): void {
  const name =
    target.classList.contains('react-flow__node') && target.matches(':focus-visible')
      ? target.getAttribute('data-id')
      : null
  if (name) useStudio.getState().select([name])
}

const keyOf = (wire: Wire | undefined): string | null => (wire ? wireKey(wire) : null)

const present = (blocks: Record<string, SheetBlock>, names: readonly string[]): SheetBlock[] =>
  names.map((name) => blocks[name]).filter((block) => block !== undefined)

const middleOf = ({ width, height }: SheetBlock, at: { x: number; y: number }) => ({
  x: at.x + width / 2,
  y: at.y + height / 2,
})
