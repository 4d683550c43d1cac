import type { NodeHandle } from '@xyflow/react'
import type { Finding, SheetPort, SheetBlock, SheetNote, Wire, WireKind, WireLines } from '../protocol'
import type { BlockNodeType } from './block_node'
import { wholeWay } from '../model/bends'
import type { NoteNodeType } from './note_node'
import { attached, endsOf, fits, type Lines, type Point } from '../model/wire_lines'
import { blockOf, portOf, wireKey, type Places } from '../model/wires'
import { PORT, side } from './sheet_layout'
import type { WireEdgeType, WireTag } from './wire_edge'

export type SheetNode = BlockNodeType | NoteNodeType

const COMMENTED = { out: 'commented out', through: 'commented through', '': '' }
const NO_FINDINGS: Finding[] = []
const NO_POINTS: Point[] = []
const NO_TAGS: WireTag[] = []
const SCALAR: WireKind = { shape: [], unit: '' }

/**
 * A cache of objects by name. An object is created again only if its inputs have changed, so that an edit
 * renders only what it affects.
 */
class Kept<T> {
  private known = new Map<string, { from: readonly unknown[]; made: T }>()
  private seen = new Map<string, { from: readonly unknown[]; made: T }>()

  get(name: string, from: readonly unknown[], make: () => T): T {
    const old = this.known.get(name)
    const entry = old?.from.every((value, k) => Object.is(value, from[k])) ? old : { from, made: make() }
    this.seen.set(name, entry)
    return entry.made
  }

  /** Drop entries that were not used since the last call. */
  turn(): void {
    this.known = this.seen
    this.seen = new Map()
  }
}

/** The inputs of the edges of a sheet. */
interface DrawnWires {
  blocks: Record<string, SheetBlock>
  wires: Wire[]
  drag: Places
  lines: Lines
  /** Whether the server's routes for the dragged blocks are overdue. */
  late: boolean
  kinds: Record<string, WireKind>
  level: string
  chosen: ReadonlySet<string>
  into: string | null
}

/** The nodes and edges of one sheet, for React Flow. */
export class SheetGraph {
  /** Sizes of notes, measured by React Flow. */
  readonly measured = new Map<string, { width: number; height: number }>()
  private blocks = new Kept<BlockNodeType>()
  private notes = new Kept<NoteNodeType>()
  private wires = new Kept<WireEdgeType>()
  private lastNodes: SheetNode[] = []
  private lastEdges: WireEdgeType[] = []

  nodes(
    blocks: Record<string, SheetBlock>,
    notes: Record<string, SheetNote>,
    findings: Finding[],
    level: string,
    drag: Places,
    selection: ReadonlySet<string>,
  ): SheetNode[] {
    const found = byBlock(findings, level)
    const made: SheetNode[] = Object.values(blocks).map((block) => {
      const { name } = block
      const own = found.get(name) ?? NO_FINDINGS
      const [x, y] = [drag[name]?.x ?? block.place.x, drag[name]?.y ?? block.place.y]
      const selected = selection.has(name)
      return this.blocks.get(
        name,
        [block, own === NO_FINDINGS ? '' : JSON.stringify(own), x, y, selected],
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
            ...block.inputs.map((spot) => port(spot, false)),
            ...block.outputs.map((spot) => port(spot, true)),
          ],
          ariaLabel: [name, block.title, COMMENTED[block.comment ?? '']].filter(Boolean).join(', '),
          data: { block, findings: own },
        }),
      )
    })
    for (const [id, note] of Object.entries(notes)) {
      const [x, y] = [drag[id]?.x ?? note.x, drag[id]?.y ?? note.y]
      const measured = this.measured.get(id)
      const selected = selection.has(id)
      made.push(
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
    this.blocks.turn()
    this.notes.turn()
    return (this.lastNodes = unlessSame(this.lastNodes, made))
  }

  edges({ wires, lines, kinds, level, chosen, into, ...drawn }: DrawnWires): WireEdgeType[] {
    const dotted = new Set<string>()
    const labelled = new Set<string>()
    const made = wires.map((wire) => {
      const net = lines[wire.source]
      const kind = kinds[level + wire.source] ?? SCALAR
      const key = wireKey(wire)
      const dots = dotted.has(wire.source) ? NO_POINTS : (net?.dots ?? NO_POINTS)
      dotted.add(wire.source)
      const { path, pending } = this.path(wire, net, drawn)
      const tags = path.length || !net ? NO_TAGS : tagsOf(wire, net.label, drawn, labelled)
      const rank = kind.bus ? 3 : Math.min(kind.shape.length, 2)
      const carried = [kind.shape.join(' × '), kind.unit].filter(Boolean)
      const label = [`${wire.source} to ${wire.target}`, ...carried].join(', ')
      const selected = chosen.has(key)
      const place = tags.map(({ x, y }) => `${x} ${y}`).join(' ')
      const from = [path, dots, net, rank, label, selected, wire, key === into, pending, place]
      return this.wires.get(key, from, () => ({
        id: key,
        type: 'wire',
        source: blockOf(wire.source),
        sourceHandle: portOf(wire.source),
        target: blockOf(wire.target),
        targetHandle: portOf(wire.target),
        selected,
        className: key === into ? 'into' : '',
        ariaLabel: `wire from ${wire.source} to ${wire.target}`,
        data: {
          path,
          dots,
          rank,
          label,
          bent: Boolean(wire.bends?.length),
          pending,
          tags,
          way: () => (net ? wholeWay(net, wire.target) : []),
        },
      }))
    })
    this.wires.turn()
    return (this.lastEdges = unlessSame(this.lastEdges, made))
  }

  /** The path of a wire; `pending`: the server has not routed the wire yet. */
  private path(
    wire: Wire,
    net: WireLines | undefined,
    { blocks, drag, late }: Pick<DrawnWires, 'blocks' | 'drag' | 'late'>,
  ): { path: readonly Point[]; pending: boolean } {
    const path = net?.paths[wire.target]
    if (path && !(blockOf(wire.source) in drag) && !(blockOf(wire.target) in drag))
      return { path, pending: false }
    const ends = endsOf(wire, blocks, drag)
    const branches = Boolean(path?.[0] && net?.dots.some(([x, y]) => x === path[0]![0] && y === path[0]![1]))
    if (!ends || path?.length === 0) return { path: NO_POINTS, pending: false }
    if (path && fits(path, branches, ends)) return { path, pending: false }
    return { path: attached(path ?? NO_POINTS, branches, ends), pending: late || !path }
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
  const shown = labelled.has(wire.source) ? ends.slice(1) : ends
  labelled.add(wire.source)
  return shown.map((end) => ({ ...end, text }))
}

const port = (spot: SheetPort, output: boolean): NodeHandle => ({
  id: spot.name,
  type: output ? 'source' : 'target',
  position: side(spot, output),
  x: spot.x - PORT / 2,
  y: spot.y - PORT / 2,
  width: PORT,
  height: PORT,
})

/** Return the previous list if it has the same elements, so that React renders nothing. */
function unlessSame<T>(before: T[], now: T[]): T[] {
  return before.length === now.length && now.every((one, k) => one === before[k]) ? before : now
}

/** The findings of the check, by the block of this sheet. */
function byBlock(findings: Finding[], level: string): Map<string, Finding[]> {
  const found = new Map<string, Finding[]>()
  for (const finding of findings) {
    if (!finding.block.startsWith(level)) continue
    const name = finding.block.slice(level.length).split('/')[0]!
    found.set(name, [...(found.get(name) ?? []), finding])
  }
  return found
}
