import type { SheetBlock, SheetPort, Wire } from '../protocol'
import { blockOf } from './wires'

type Connections = readonly Wire[]

/**
 * The wires from selected blocks to a block: of one selected block, its outputs in their order; of several
 * blocks, the first output of each. They end at the unconnected inputs of the block. A block that already
 * drives it gets no further wire. Without such a wire, one selected block and the block are connected at one
 * frame.
 */
export function connectionsTo(
  target: SheetBlock,
  selected: readonly SheetBlock[],
  wires: Connections,
): Wire[] {
  const driven = new Set(wires.map((wire) => wire.target))
  const signalInputs = new Set(refs(target, signals(target.inputs)))
  const drivers = new Set(
    wires.filter((wire) => signalInputs.has(wire.target)).map(({ source }) => blockOf(source)),
  )
  const others = selected.filter(({ name }) => name !== target.name)
  const sources = others.filter(({ name }) => !drivers.has(name))
  const inputs = [...signalInputs].filter((input) => !driven.has(input))
  const outputs = sources.flatMap((block) =>
    refs(block, signals(block.outputs)).slice(0, sources.length === 1 ? undefined : 1),
  )
  const added = inputs.slice(0, outputs.length).map((input, k) => ({ source: outputs[k]!, target: input }))
  const [source] = others
  return added.length || others.length !== 1 || !source ? added : frameLine(source, target, wires)
}

/** The line from a frame port of one block to a frame port of another, unless they have a common frame. */
function frameLine(source: SheetBlock, target: SheetBlock, wires: Connections): Wire[] {
  const connected = new Set(wires.flatMap((wire) => [wire.source, wire.target]))
  /** Unconnected ports come first, then ports at the given side. */
  const preferred = (block: SheetBlock, side: number) => {
    const rank = (port: SheetPort) =>
      2 * Number(connected.has(`${block.name}/${port.name}`)) + Number(port.dx * side <= 0)
    return refs(block, frames(block)).sort((a, b) => rank(portAt(block, a)) - rank(portAt(block, b)))
  }
  const [from, to] = [preferred(source, 1), preferred(target, -1)]
  const present = new Set(from.map((ref) => firstOfFrame(ref, wires)))
  if (!from[0] || !to[0] || to.some((ref) => present.has(firstOfFrame(ref, wires)))) return []
  return [{ source: from[0], target: to[0] }]
}

const signals = (ports: readonly SheetPort[]) => ports.filter(({ frame }) => !frame)
/** The frame ports of a block. They are both inputs and outputs. */
const frames = ({ inputs }: SheetBlock) => inputs.filter(({ frame }) => frame)
const refs = ({ name }: SheetBlock, ports: readonly SheetPort[]) =>
  ports.map((port) => `${name}/${port.name}`)
const portAt = ({ name, inputs }: SheetBlock, ref: string) =>
  inputs.find((port) => `${name}/${port.name}` === ref)!

/** The first port of the frame of a port: the lines of a frame start there. */
const firstOfFrame = (ref: string, wires: Connections): string =>
  wires.find(({ target }) => target === ref)?.source ?? ref

/**
 * The wires that connect the former neighbours of removed blocks. A block with one input, one output and no
 * frame port passes its signal on; so does a chain of these blocks. The frames at the two frame ports of a
 * block, such as a joint, become one frame.
 */
export function reconnections(removed: readonly SheetBlock[], wires: Connections): Wire[] {
  const blocks = new Map(removed.map((block) => [block.name, block]))
  const drivers = new Map(wires.map(({ source, target }) => [target, source]))
  /** The output in front of the removed blocks that drives an output. */
  const remainingDriver = (output: string | undefined): string | undefined => {
    const passed = new Set<string>()
    for (let source = output; source !== undefined;) {
      const block = blocks.get(blockOf(source))
      if (!block) return source
      if (!passesSignal(block) || passed.has(block.name)) return undefined
      passed.add(block.name)
      source = drivers.get(`${block.name}/${block.inputs[0]!.name}`)
    }
    return undefined
  }
  const ofSignals = wires.flatMap(({ source, target }) => {
    const block = blocks.get(blockOf(source))
    if (!block || !passesSignal(block) || blocks.has(blockOf(target))) return []
    const driver = remainingDriver(source)
    return driver === undefined ? [] : [{ source: driver, target }]
  })
  return [...ofSignals, ...joinedFrames(removed, wires)]
}

const passesSignal = (block: SheetBlock): boolean =>
  block.inputs.length === 1 && block.outputs.length === 1 && !frames(block).length

/** The lines that join the frames at both frame ports of each removed block. */
function joinedFrames(removed: readonly SheetBlock[], wires: Connections): Wire[] {
  const names = new Set(removed.map(({ name }) => name))
  /** For a frame that is joined with another one: the first port of the other one. */
  const joined = new Map<string, string>()
  const root = (first: string): string => {
    const next = joined.get(first)
    return next === undefined ? first : root(next)
  }
  const involved = new Set<string>()
  for (const block of removed) {
    const ends = refs(block, frames(block)).map((ref) => firstOfFrame(ref, wires))
    if (ends.length !== 2) continue
    for (const end of ends) involved.add(end)
    const [one, other] = ends.map(root)
    if (one !== other) joined.set(one!, other!)
  }
  const first = new Map<string, string>()
  return [...involved].flatMap((frame) => {
    const ports = [frame, ...wires.filter(({ source }) => source === frame).map(({ target }) => target)]
    const remaining = ports.find((ref) => !names.has(blockOf(ref)))
    if (remaining === undefined) return []
    const start = first.get(root(frame))
    if (start !== undefined) return [{ source: start, target: remaining }]
    first.set(root(frame), remaining)
    return []
  })
}
