import type { NodeHandle } from '@xyflow/react'
import type { Finding, SheetPort, SheetBlock, SheetNote, Wire, WireKind, WireLines } from '../protocol'
import type { BlockNodeType } from './block_node'
import { completeRoute } from '../model/bends'
import type { NoteNodeType } from './note_node'
import { stretchedToPorts, endsOf, endsAtPorts, type Lines, type Point } from '../model/wire_lines'
import { blockOf, isFrame, portOf, wireKey, type Places } from '../model/wires'
import { PORT, portSide } from './sheet_layout'
import type { WireEdgeType, WireTag } from './wire_edge'

export type SheetNode = BlockNodeType | NoteNodeType

const COMMENTED = { out: 'commented out', through: 'commented through', '': '' }
const NO_FINDINGS: Finding[] = []
const NO_POINTS: Point[] = []
const NO_TAGS: WireTag[] = []
const SCALAR: WireKind = { shape: [], unit: '' }

/**
 * A cache of objects by name. An object is created again only if its inputs have changed, so that an edit
 * renders only the affected blocks and wires.
 */
class ObjectCache<T> {
  private previous = new Map<string, { from: readonly unknown[]; object: T }>()
  private current = new Map<string, { from: readonly unknown[]; object: T }>()

  get(name: string, inputs: readonly unknown[], create: () => T): T {
    const cached = this.previous.get(name)
    const entry = cached?.from.every((value, k) => Object.is(value, inputs[k]))
      ? cached
      : { from: inputs, object: create() }
    this.current.set(name, entry)
    return entry.object
  }

  /** Drop entries that were not used since the last call. */
  dropUnused(): void {
    this.previous = this.current
    this.current = new Map()
  }
}

/** The inputs of the edges of a sheet. */
interface DrawnWires {
  blocks: Record<string, SheetBlock>
  wires: Wire[]
  drag: Places
  lines: Lines
  /** Whether the server's routes for the dragged blocks are overdue. */
  overdue: boolean
  kinds: Record<string, WireKind>
  pathPrefix: string
  selectedWires: ReadonlySet<string>
  targetWire: string | null
}

/** The nodes and edges of one sheet, for React Flow. */
export class SheetGraph {
  /** Sizes of notes, measured by React Flow. */
  readonly measured = new Map<string, { width: number; height: number }>()
  private blocks = new ObjectCache<BlockNodeType>()
  private notes = new ObjectCache<NoteNodeType>()
  private wires = new ObjectCache<WireEdgeType>()
  private previousNodes: SheetNode[] = []
  private previousEdges: WireEdgeType[] = []

  nodes(
    blocks: Record<string, SheetBlock>,
    notes: Record<string, SheetNote>,
    findings: Finding[],
    pathPrefix: string,
    drag: Places,
    selection: ReadonlySet<string>,
  ): SheetNode[] {
    const findingsByBlock = groupByBlock(findings, pathPrefix)
    const nodes: SheetNode[] = Object.values(blocks).map((block) => {
      const { name } = block
      const blockFindings = findingsByBlock.get(name) ?? NO_FINDINGS
      const [x, y] = [drag[name]?.x ?? block.place.x, drag[name]?.y ?? block.place.y]
      const selected = selection.has(name)
      return this.blocks.get(
        name,
        [block, blockFindings === NO_FINDINGS ? '' : JSON.stringify(blockFindings), x, y, selected],
        () => ({
          id: name,
          type: 'block',
          position: { x, y },
          selected,
          width: block.width,
          height: block.height,
          // All sizes are known, so React Flow need not measure blocks.
          measured: { width: block.width, height: block.height },
          handles: [
            ...block.inputs.map((portSpot) => port(portSpot, false)),
            ...block.outputs.map((portSpot) => port(portSpot, true)),
          ],
          ariaLabel: [name, block.title, COMMENTED[block.comment ?? '']].filter(Boolean).join(', '),
          data: { block, findings: blockFindings },
        }),
      )
    })
    for (const [id, note] of Object.entries(notes)) {
      const [x, y] = [drag[id]?.x ?? note.x, drag[id]?.y ?? note.y]
      const measured = this.measured.get(id)
      const selected = selection.has(id)
      nodes.push(
        this.notes.get(id, [note, x, y, measured, selected], () => ({
          id,
          type: 'note',
          position: { x, y },
          selected,
          ...(measured ? { measured } : {}),
          ariaLabel: `Note: ${note.text}`,
          data: { note },
        })),
      )
    }
    this.blocks.dropUnused()
    this.notes.dropUnused()
    return (this.previousNodes = reuseIfEqual(this.previousNodes, nodes))
  }

  edges({
    wires,
    lines,
    kinds,
    pathPrefix,
    selectedWires,
    targetWire,
    ...drawn
  }: DrawnWires): WireEdgeType[] {
    const dotted = new Set<string>()
    const labelled = new Set<string>()
    const edges = wires.map((wire) => {
      const net = lines[wire.source]
      const kind = kinds[pathPrefix + wire.source] ?? SCALAR
      const key = wireKey(wire)
      const dots = dotted.has(wire.source) ? NO_POINTS : (net?.dots ?? NO_POINTS)
      dotted.add(wire.source)
      const { path, pending } = this.path(wire, net, drawn)
      const tags = path.length || !net ? NO_TAGS : tagsOf(wire, net.label, drawn, labelled)
      const rank = kind.bus ? 3 : Math.min(kind.shape.length, 2)
      const frame = isFrame(drawn.blocks, wire.source)
      const valueType = [kind.shape.join(' × '), kind.unit].filter(Boolean)
      const ends = frame ? `frame of ${wire.source} and ${wire.target}` : `${wire.source} to ${wire.target}`
      const label = [ends, ...valueType].join(', ')
      const selected = selectedWires.has(key)
      const tagPositions = tags.map(({ x, y }) => `${x} ${y}`).join(' ')
      const states = [selected, key === targetWire, pending, frame]
      const inputs = [path, dots, net, rank, label, wire, tagPositions, ...states]
      return this.wires.get(key, inputs, () => ({
        id: key,
        type: 'wire',
        source: blockOf(wire.source),
        sourceHandle: portOf(wire.source),
        target: blockOf(wire.target),
        targetHandle: portOf(wire.target),
        selected,
        className: key === targetWire ? 'into' : '',
        ariaLabel: frame
          ? `frame line between ${wire.source} and ${wire.target}`
          : `wire from ${wire.source} to ${wire.target}`,
        data: {
          path,
          dots,
          rank,
          frame,
          label,
          bent: Boolean(wire.bends?.length),
          pending,
          tags,
          route: () => (net ? completeRoute(net, wire.target) : []),
        },
      }))
    })
    this.wires.dropUnused()
    return (this.previousEdges = reuseIfEqual(this.previousEdges, edges))
  }

  /** The path of a wire; `pending`: the server has not routed the wire yet. */
  private path(
    wire: Wire,
    net: WireLines | undefined,
    { blocks, drag, overdue }: Pick<DrawnWires, 'blocks' | 'drag' | 'overdue'>,
  ): { path: readonly Point[]; pending: boolean } {
    const path = net?.paths[wire.target]
    if (path && !(blockOf(wire.source) in drag) && !(blockOf(wire.target) in drag))
      return { path, pending: false }
    const ends = endsOf(wire, blocks, drag)
    const branches = Boolean(path?.[0] && net?.dots.some(([x, y]) => x === path[0]![0] && y === path[0]![1]))
    if (!ends || path?.length === 0) return { path: NO_POINTS, pending: false }
    if (path && endsAtPorts(path, branches, ends)) return { path, pending: false }
    return { path: stretchedToPorts(path ?? NO_POINTS, branches, ends), pending: overdue || !path }
  }
}

/** The labels of a wire without a line: at its target, and once at its output. */
function tagsOf(
  wire: Wire,
  text: string,
  { blocks, drag }: Pick<DrawnWires, 'blocks' | 'drag'>,
  labelled: Set<string>,
): WireTag[] {
  const ends = endsOf(wire, blocks, drag)
  if (!ends) return NO_TAGS
  const unlabelledEnds = labelled.has(wire.source) ? ends.slice(1) : ends
  labelled.add(wire.source)
  return unlabelledEnds.map((end) => ({ ...end, text }))
}

const port = (portSpot: SheetPort, output: boolean): NodeHandle => ({
  id: portSpot.name,
  type: output ? 'source' : 'target',
  position: portSide(portSpot, output),
  x: portSpot.x - PORT / 2,
  y: portSpot.y - PORT / 2,
  width: PORT,
  height: PORT,
})

/** Return the previous list if it has the same elements, so that React renders nothing. */
function reuseIfEqual<T>(before: T[], next: T[]): T[] {
  return before.length === next.length && next.every((one, k) => one === before[k]) ? before : next
}

/** The findings of the check, by the block of this sheet. */
function groupByBlock(findings: Finding[], pathPrefix: string): Map<string, Finding[]> {
  const findingsByBlock = new Map<string, Finding[]>()
  for (const finding of findings) {
    if (!finding.block.startsWith(pathPrefix)) continue
    const name = finding.block.slice(pathPrefix.length).split('/')[0]!
    findingsByBlock.set(name, [...(findingsByBlock.get(name) ?? []), finding])
  }
  return findingsByBlock
}
