import { freeBelow, freeInView, type Rectangle } from '../model/free_place'
import type { BlockType, Place, Wire } from '../protocol'
import { isFrame, newThroughPorts } from '../model/wires'
import { change, freeName, namesInUse, selectIfUnchanged, useStudio } from '../store'
import { focusWhenShown } from '../sheet_focus'
import { usePlaced } from './placed_block'
import { sheetView } from './sheet_actions'

/** Drag data from the library: a block type. */
export const BLOCK_TYPE = 'application/x-armblocks-block'

/** Grid of block positions, px. */
export const GRID = 5

interface Insertion {
  /** The wire into which the block is inserted. */
  wire?: Wire
  /** y of the wire that enters the first input, px; the block is placed so that this wire is straight. */
  wireY?: number
  /** A port to which the block is connected; the point is then at the edge of the block. */
  connectTo?: { port: string; isOutput: boolean; instead?: Wire[] }
  /** Whether the view is moved so that the block is visible. */
  reveal?: boolean
  /** The values of its parameters that differ from the defaults. */
  parameters?: Record<string, unknown>
  /** The preferred name; a number is appended if it is in use. */
  name?: string
}

/** Names of new blocks that the sheet does not show yet. */
const awaitedNames = new Set<string>()

/** Add a new block of a type with its centre at a point, and select it; the result is its name. */
export async function insertBlock(
  type: string,
  at: { x: number; y: number },
  { wire, wireY, connectTo, reveal = false, parameters = {}, name: preferredName }: Insertion = {},
): Promise<string | undefined> {
  const { document, library, selection } = useStudio.getState()
  const blockType = library.get(type)
  if (!document || !blockType) return undefined
  const preferred = (preferredName ?? blockType.title).replace(/[/.]/g, ' ')
  const name = freeName(preferred, [...namesInUse(), ...awaitedNames])
  const inputY = wireY === undefined ? undefined : leftInputY(blockType)
  const fraction = !connectTo ? 0.5 : connectTo.isOutput ? 0 : 1
  const place: Place = {
    x: GRID * Math.round((at.x - fraction * blockType.width) / GRID),
    y: inputY === undefined ? GRID * Math.round((at.y - blockType.height / 2) / GRID) : wireY! - inputY,
  }
  const end = connectTo?.port ?? wire?.source
  const [input, output] = newThroughPorts(blockType, Boolean(end && isFrame(document.blocks, end)))
  const splitsWire = wire && input && output
  awaitedNames.add(name)
  const version = await change({
    kind: 'add',
    blocks: [{ name, type, place, parameters }],
    wires: connectTo
      ? [
          connectTo.isOutput
            ? { source: connectTo.port, target: `${name}/${input}` }
            : { source: `${name}/${output}`, target: connectTo.port },
        ]
      : splitsWire
        ? [
            { source: wire.source, target: `${name}/${input}` },
            { source: `${name}/${output}`, target: wire.target },
          ]
        : [],
    instead: connectTo?.instead ?? (splitsWire ? [wire] : []),
  }).finally(() => awaitedNames.delete(name))
  if (version === undefined) return undefined
  selectIfUnchanged(selection, [name])
  focusWhenShown(name, () => useStudio.getState().selection.has(name))
  if (!wire && !connectTo) usePlaced.setState({ name, at: undefined })
  if (reveal) sheetView.reveal?.({ ...place, width: blockType.width, height: blockType.height })
  return name
}

/** The point of the sheet at a point of the window. */
export function sheetPointAt(clientPoint: { x: number; y: number }): { x: number; y: number } {
  const pane = document.querySelector('.react-flow__viewport')
  const matrix = new DOMMatrix(pane ? getComputedStyle(pane).transform : undefined)
  const corner = document.querySelector('.react-flow')?.getBoundingClientRect()
  return {
    x: (clientPoint.x - (corner?.x ?? 0) - matrix.e) / matrix.a,
    y: (clientPoint.y - (corner?.y ?? 0) - matrix.f) / matrix.a,
  }
}

/** y of the first input from the top of the block, px, if it is at the left edge. */
function leftInputY({ input_y, height }: BlockType): number | undefined {
  const [first] = input_y
  return first !== undefined && first > 0 && first < height ? first : undefined
}

/** Distance between the selected block and a new block to its right, px. */
const GAP = 60

/** Add a block by its name: right of the selected block, or else in the middle of the visible part. */
export function addBlock(blockType: BlockType): void {
  const { document, selection } = useStudio.getState()
  const blocks = Object.values(document?.blocks ?? {})
  const boxes = blocks.map(({ place: { x, y }, width, height }) => ({ x, y, width, height }))
  const selected = blocks.find(({ name }) => selection.has(name))
  const { width, height } = blockType
  if (!selected) {
    const view = sheetView.visible?.() ?? { x: 0, y: 0, width: 600, height: 400 }
    void insertBlock(blockType.type, centreOf(freeInView({ width, height }, view, boxes)), { reveal: true })
    return
  }
  const output = selected.outputs.find(({ dx }) => dx > 0)
  const level = selected.place.y + (output?.y ?? selected.height / 2)
  const y = level - (leftInputY(blockType) ?? height / 2)
  const preferred = { x: selected.place.x + selected.width + GAP, y, width, height }
  const free = freeBelow(preferred, boxes)
  const wireOption = output ? { wireY: level + free.y - y } : {}
  void insertBlock(blockType.type, centreOf(free), { ...wireOption, reveal: true })
}

const centreOf = ({ x, y, width, height }: Rectangle) => ({ x: x + width / 2, y: y + height / 2 })
