import type { NewBlock, SheetBlock, Wire } from '../protocol'
import { change, freeName, useStudio } from '../store'
import { blockOf, portOf } from './sheet_layout'

const MARK = 'armblocks-blocks'
const SHIFT = 30

interface Clip {
  [MARK]: 1
  blocks: NewBlock[]
  wires: Wire[]
}

/** What the fields of a block say, as an edit takes it: a robot by its name. */
function typed(value: unknown): unknown {
  return value && typeof value === 'object' && 'source' in value ? (value as { source: string }).source : value
}

function clip(blocks: SheetBlock[], wires: Wire[]): Clip {
  const names = new Set(blocks.map(({ name }) => name))
  return {
    [MARK]: 1,
    blocks: blocks.map(({ name, type, place, parameters }) => ({
      name,
      type,
      place,
      parameters: Object.fromEntries(Object.entries(parameters).map(([key, value]) => [key, typed(value)])),
    })),
    wires: wires.filter(({ source, target }) => names.has(blockOf(source)) && names.has(blockOf(target))),
  }
}

/** Put blocks and the wires among them on the sheet, under names that are free. */
function add({ blocks, wires }: Clip): void {
  const { document, select } = useStudio.getState()
  if (!document || !blocks.length) return
  const taken = new Set(Object.keys(document.blocks))
  const renamed = new Map<string, string>()
  for (const { name } of blocks) {
    const free = freeName(name, taken)
    taken.add(free)
    renamed.set(name, free)
  }
  const moved = (port: string) => `${renamed.get(blockOf(port))}/${portOf(port)}`
  void change({
    kind: 'add',
    blocks: blocks.map((block) => ({
      ...block,
      name: renamed.get(block.name)!,
      place: { ...block.place, x: block.place.x + SHIFT, y: block.place.y + SHIFT },
    })),
    wires: wires.map(({ source, target }) => ({ source: moved(source), target: moved(target) })),
  }).then(() => select(renamed.values()))
}

export function duplicate(blocks: SheetBlock[], wires: Wire[]): void {
  add(clip(blocks, wires))
}

/** Blocks travel as text, so that they can be pasted into another window or a mail. */
export async function copy(blocks: SheetBlock[], wires: Wire[]): Promise<void> {
  if (blocks.length) await navigator.clipboard.writeText(JSON.stringify(clip(blocks, wires), null, 2))
}

export async function cut(blocks: SheetBlock[], wires: Wire[]): Promise<void> {
  await copy(blocks, wires)
  if (blocks.length) await change({ kind: 'remove', blocks: blocks.map(({ name }) => name) })
}

export async function paste(): Promise<void> {
  try {
    const found: unknown = JSON.parse(await navigator.clipboard.readText())
    if (found && typeof found === 'object' && MARK in found) add(found as Clip)
  } catch {
    // Something else lies on the clipboard: nothing to paste here.
  }
}
