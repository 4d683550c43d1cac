import { Anchor, Breadcrumbs, useComputedColorScheme } from '@mantine/core'
import { IconLink } from '@tabler/icons-react'
import {
  Background,
  BackgroundVariant,
  ConnectionLineType,
  Controls,
  MiniMap,
  ReactFlow,
  ReactFlowProvider,
  useReactFlow,
  type Connection,
  type NodeChange,
} from '@xyflow/react'
import { useCallback, useEffect, useMemo, useRef, useState } from 'react'
import type { Place, SheetBlock } from '../protocol'
import { ask, change, freeName, look, useStudio } from '../store'
import { BlockNode, type BlockNodeType } from './block_node'
import { openQuickInsert } from '../library/quick_insert'
import { WireValues } from '../run/wire_values'
import { openShortcuts } from '../shortcuts'
import { openConnectDialog } from './connect_dialog'
import { copy, cut, duplicate, paste } from './clipboard'
import { GRID, insertBlock } from './insert'
import { SheetRoutes, blockOf, portOf, wireKey, type Places } from './sheet_layout'
import { WireEdge, type WireEdgeType } from './wire_edge'

const nodeTypes = { block: BlockNode }
const edgeTypes = { wire: WireEdge }
const NONE: never[] = []
const NUDGE = 5
const SETTLE_MS = 120

export function Canvas() {
  const document = useStudio((s) => s.document)
  if (!document) return <p className="empty">Opening …</p>
  const { state, inside } = document
  return (
    <div className="sheet">
      {inside.length > 0 && (
        <Breadcrumbs className="breadcrumbs" separator="›" aria-label="Subsystems">
          {[state.title, ...inside].map((name, depth) => (
            <Anchor key={`${depth} ${name}`} component="button" size="sm" onClick={() => look(inside.slice(0, depth))}>
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
  const findings = useStudio((s) => s.document!.findings)
  const kinds = useStudio((s) => s.document!.wireKinds)
  const level = useStudio((s) => s.document!.inside.map((name) => `${name}/`).join(''))
  const selection = useStudio((s) => s.selection)
  const select = useStudio((s) => s.select)
  const scheme = useComputedColorScheme('light')
  const flow = useReactFlow()
  const [drag, setDrag] = useState<Places>({})
  const [chosenWires, setChosenWires] = useState<ReadonlySet<string>>(new Set())
  const routes = useRef(new SheetRoutes())
  const measured = useRef(new Map<string, { width: number; height: number }>())

  // A place that the server has taken over needs no memory of the drag any more.
  useEffect(() => setDrag({}), [blocks])

  const nodes = useMemo<BlockNodeType[]>(
    () =>
      Object.values(blocks).map((block) => ({
        id: block.name,
        type: 'block',
        position: drag[block.name] ?? { x: block.place.x, y: block.place.y },
        selected: selection.has(block.name),
        width: block.width,
        height: block.height,
        measured: measured.current.get(block.name) ?? { width: block.width, height: block.height },
        ariaLabel: `${block.name}, ${block.title}`,
        data: { block, findings: findings.filter((found) => `${found.block}/`.startsWith(`${level}${block.name}/`)), value: '' },
      })),
    [blocks, drag, selection, findings, level],
  )

  const routed = useMemo(() => routes.current.update(blocks, wires, drag), [blocks, wires, drag])
  const edges = useMemo<WireEdgeType[]>(
    () =>
      wires.map((wire) => {
        const net = routed.get(wire.source)
        const kind = kinds[level + wire.source]
        const key = wireKey(wire)
        const first = wires.find((other) => other.source === wire.source) === wire
        return {
          id: key,
          type: 'wire',
          source: blockOf(wire.source),
          sourceHandle: portOf(wire.source),
          target: blockOf(wire.target),
          targetHandle: portOf(wire.target),
          selected: chosenWires.has(key),
          ariaLabel: `wire from ${wire.source} to ${wire.target}`,
          data: {
            path: [...(net?.paths.get(key) ?? NONE)],
            dots: first ? (net?.dots ?? NONE) : NONE,
            rank: kind?.shape.length ?? 0,
            label: `${wire.source} to ${wire.target}${kind?.shape.length ? `, ${kind.shape.join(' × ')}` : ''}${kind?.unit ? `, ${kind.unit}` : ''}`,
          },
        }
      }),
    [wires, routed, kinds, chosenWires, level],
  )

  const onNodesChange = useCallback(
    (changes: NodeChange<BlockNodeType>[]) => {
      const places: Places = {}
      let chosen: Set<string> | null = null
      for (const one of changes) {
        if (one.type === 'position' && one.position) places[one.id] = one.position
        else if (one.type === 'select') {
          chosen ??= new Set(useStudio.getState().selection)
          if (one.selected) chosen.add(one.id)
          else chosen.delete(one.id)
        } else if (one.type === 'dimensions' && one.dimensions) measured.current.set(one.id, one.dimensions)
      }
      if (Object.keys(places).length) setDrag((now) => ({ ...now, ...places }))
      if (chosen) select(chosen)
    },
    [select],
  )

  const move = useCallback((places: Places) => {
    const { document } = useStudio.getState()
    const moved: Record<string, Place> = {}
    for (const [name, { x, y }] of Object.entries(places)) {
      const place = document?.blocks[name]?.place
      if (place && (place.x !== x || place.y !== y)) moved[name] = { ...place, x, y }
    }
    if (Object.keys(moved).length) void change({ kind: 'move', places: moved })
  }, [])

  const connect = useCallback(({ source, sourceHandle, target, targetHandle }: Connection) => {
    if (sourceHandle && targetHandle)
      void change({ kind: 'connect', wire: { source: `${source}/${sourceHandle}`, target: `${target}/${targetHandle}` } })
  }, [])

  const remove = useCallback(() => {
    const { document, selection } = useStudio.getState()
    const gone = wires.filter((wire) => chosenWires.has(wireKey(wire)))
    const names = [...selection].filter((name) => document?.blocks[name])
    if (names.length || gone.length) void change({ kind: 'remove', blocks: names, wires: gone })
    select([])
    setChosenWires(new Set())
  }, [wires, chosenWires, select])

  const drop = useCallback(
    (event: React.DragEvent) => {
      const type = event.dataTransfer.getData('application/x-armblocks-block')
      if (!type) return
      event.preventDefault()
      insertBlock(type, flow.screenToFlowPosition({ x: event.clientX, y: event.clientY }))
    },
    [flow],
  )

  const sheet = useRef<HTMLDivElement>(null)
  const onKeyDown = (event: KeyboardEvent) => {
    // Keys belong to the sheet while it has the focus, and while nothing has it (a focused block may have gone);
    // a button elsewhere keeps only the keys that press it.
    const focused = event.target instanceof Element ? event.target : null
    if (focused instanceof HTMLInputElement || focused?.closest('[role="dialog"], [role="menu"], [role="slider"]')) return
    const ours = focused === window.document.body || sheet.current?.contains(focused)
    if (!ours && (event.key === 'Enter' || event.key === ' ' || event.key.length > 1)) return
    const chosen = [...useStudio.getState().selection].map((name) => blocks[name]).filter((block) => block !== undefined)
    const plain = !event.ctrlKey && !event.metaKey && !event.altKey
    const step = event.shiftKey ? 1 : NUDGE
    const arrows: Record<string, [number, number]> = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }
    const arrow = arrows[event.key]
    if (event.key === 'Delete' || event.key === 'Backspace') remove()
    else if (event.key === 'Enter' && plain && chosen[0]) open(chosen[0])
    else if (arrow && plain && chosen.length)
      move(Object.fromEntries(chosen.map(({ name, place }) => [name, { x: place.x + arrow[0], y: place.y + arrow[1] }])))
    else if (event.key === '>' && plain) openConnectDialog()
    else if (event.key === '?' && plain) openShortcuts()
    else if (event.key === ' ' && plain) void flow.fitView({ duration: 150 })
    else if (event.key === 'Escape' && level && !chosen.length) look(useStudio.getState().document!.inside.slice(0, -1))
    else if (event.key === 'Escape') select([])
    else if (plain && /^\p{L}$/u.test(event.key)) openQuickInsert(event.key)
    else if (event.ctrlKey || event.metaKey) {
      const key = event.key.toLowerCase()
      if (key === 'a') select(Object.keys(blocks))
      else if (key === 'i') flip(chosen)
      else if (key === 'g') group(chosen)
      else if (key === 'd') duplicate(chosen, wires)
      else if (key === 'c') void copy(chosen, wires)
      else if (key === 'x') void cut(chosen, wires)
      else if (key === 'v') void paste()
      else return
    } else return
    event.preventDefault()
    event.stopPropagation()
  }

  useEffect(() => {
    addEventListener('keydown', onKeyDown)
    return () => removeEventListener('keydown', onKeyDown)
  })
  // The sheet fits its panel, whatever size that takes, until somebody moves it.
  useEffect(() => {
    const element = sheet.current
    if (!element) return
    let timer = 0
    const sized = new ResizeObserver(() => {
      clearTimeout(timer)
      timer = window.setTimeout(() => void flow.fitView({ padding: 0.08, maxZoom: 1.25 }), SETTLE_MS)
    })
    const leave = () => {
      clearTimeout(timer)
      sized.disconnect()
    }
    sized.observe(element)
    for (const kind of ['pointerdown', 'wheel', 'keydown']) element.addEventListener(kind, leave, { once: true })
    return leave
  }, [flow])

  const empty = Object.keys(blocks).length === 0
  return (
    <div className="canvas" ref={sheet} onFocus={selectFocused} onDragOver={(event) => event.preventDefault()} onDrop={drop}>
      <svg className="defs" width="0" height="0" aria-hidden>
        <marker id="wire-head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" markerUnits="userSpaceOnUse" orient="auto">
          <path d="M0 0.300L8 4L0 7.700Z" className="f-wire" />
        </marker>
      </svg>
      <ReactFlow<BlockNodeType, WireEdgeType>
        nodes={nodes}
        edges={edges}
        nodeTypes={nodeTypes}
        edgeTypes={edgeTypes}
        colorMode={scheme}
        onNodesChange={onNodesChange}
        onNodeDragStop={(_, __, moved) => move(Object.fromEntries(moved.map(({ id, position }) => [id, position])))}
        onNodeDoubleClick={(_, node) => open(node.data.block)}
        onEdgesChange={(changes) => {
          const chosen = new Set(chosenWires)
          for (const one of changes) {
            if (one.type !== 'select') continue
            if (one.selected) chosen.add(one.id)
            else chosen.delete(one.id)
          }
          setChosenWires(chosen)
        }}
        onConnect={connect}
        onDoubleClick={(event) => {
          if ((event.target as Element).classList.contains('react-flow__pane')) openQuickInsert('', { x: event.clientX, y: event.clientY })
        }}
        zoomOnDoubleClick={false}
        connectionLineType={ConnectionLineType.Step}
        connectionRadius={24}
        deleteKeyCode={null}
        disableKeyboardA11y
        snapToGrid
        snapGrid={[GRID, GRID]}
        selectionOnDrag
        panOnDrag={[1, 2]}
        panOnScroll
        zoomOnPinch
        minZoom={0.1}
        maxZoom={4}
        fitView
        fitViewOptions={{ padding: 0.08, maxZoom: 1.25 }}
        aria-label="Diagram"
      >
        <Background variant={BackgroundVariant.Dots} gap={20} size={1} />
        <Controls showInteractive={false} />
        <WireValues />
        {Object.keys(blocks).length > 40 && <MiniMap pannable zoomable />}
      </ReactFlow>
      {empty && (
        <div className="empty over">
          <p>
            Type to add a block, or drag one from the library.
            <br />
            The examples are in the menu at the top left.
          </p>
        </div>
      )}
    </div>
  )
}

/** Going through the blocks with Tab selects the one that has the focus. */
function selectFocused({ target }: React.FocusEvent): void {
  const name = target.classList.contains('react-flow__node') && target.matches(':focus-visible') ? target.getAttribute('data-id') : null
  if (name) useStudio.getState().select([name])
}

/** A double click: into a subsystem that has no mask, else the parameters of a block. */
function open(block: SheetBlock): void {
  const { document, edit } = useStudio.getState()
  if (block.opens && !block.mask.length && document) look([...document.inside, block.name])
  else edit(block.name)
}

/** Put the blocks into a subsystem of their own. */
function group(chosen: SheetBlock[]): void {
  const { document, select } = useStudio.getState()
  if (!document || !chosen.length) return
  const name = freeName('Subsystem', Object.keys(document.blocks))
  void change({ kind: 'group', blocks: chosen.map((block) => block.name), name }).then(() => select([name]))
}

function flip(chosen: SheetBlock[]): void {
  if (chosen.length)
    void change({ kind: 'move', places: Object.fromEntries(chosen.map(({ name, place }) => [name, { ...place, flipped: !place.flipped }])) })
}
