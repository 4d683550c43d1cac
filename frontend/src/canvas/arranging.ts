import type { Place, SheetBlock } from '../protocol'
import { change, freeName, namesInUse, selectIfUnchanged, useStudio } from '../store'

/** Commands on all selected blocks: each is one undo step. */

export function selectedBlocks(): SheetBlock[] {
  const { document, selection } = useStudio.getState()
  return [...selection].map((name) => document?.blocks[name]).filter((block) => block !== undefined)
}

function changePlaces(changeOf: (block: SheetBlock) => Partial<Place>): void {
  const selected = selectedBlocks()
  const positions = Object.fromEntries(
    selected.map((block) => [block.name, { ...block.place, ...changeOf(block) }]),
  )
  const unchanged = selected.every(
    (block) => JSON.stringify(positions[block.name]) === JSON.stringify(block.place),
  )
  if (!unchanged) void change({ kind: 'move', places: positions })
}

export const flip = (): void => changePlaces(({ place }) => ({ flipped: !place.flipped }))

export function rotate(): void {
  changePlaces(({ place }) => ({ rotation: (((place.rotation ?? 0) + 90) % 360) as 0 | 90 | 180 | 270 }))
}

export const shift = (dx: number, dy: number): void =>
  changePlaces(({ place }) => ({ x: place.x + dx, y: place.y + dy }))

export type Edge = 'left' | 'centre' | 'right' | 'top' | 'middle' | 'bottom'

const rightOf = ({ place, width }: SheetBlock) => place.x + width
const bottomOf = ({ place, height }: SheetBlock) => place.y + height

/** Align the selected blocks: by an edge or by their centres. */
export function align(edge: Edge): void {
  const selected = selectedBlocks()
  const [left, right] = [
    Math.min(...selected.map(({ place }) => place.x)),
    Math.max(...selected.map(rightOf)),
  ]
  const [top, bottom] = [
    Math.min(...selected.map(({ place }) => place.y)),
    Math.max(...selected.map(bottomOf)),
  ]
  const placeFor: Record<Edge, (block: SheetBlock) => Partial<Place>> = {
    left: () => ({ x: left }),
    centre: ({ width }) => ({ x: (left + right - width) / 2 }),
    right: ({ width }) => ({ x: right - width }),
    top: () => ({ y: top }),
    middle: ({ height }) => ({ y: (top + bottom - height) / 2 }),
    bottom: ({ height }) => ({ y: bottom - height }),
  }
  changePlaces(placeFor[edge])
}

/** Make the gaps between the selected blocks equal; the outer two blocks do not move. */
export function distribute(axis: 'x' | 'y'): void {
  const size = axis === 'x' ? 'width' : 'height'
  const selected = selectedBlocks().sort((a, b) => a.place[axis] - b.place[axis])
  const [first, last] = [selected[0], selected.at(-1)]
  if (!first || !last || selected.length < 3) return
  const space = last.place[axis] + last[size] - first.place[axis]
  const gap = (space - selected.reduce((sum, block) => sum + block[size], 0)) / (selected.length - 1)
  const positions = new Map<string, number>()
  let position = first.place[axis]
  for (const block of selected) {
    positions.set(block.name, position)
    position += block[size] + gap
  }
  changePlaces(({ name }) => ({ [axis]: positions.get(name) }))
}

/** Comment the selected blocks out or through. If all have this comment already, remove it. */
export function comment(mode: 'out' | 'through'): void {
  const selected = selectedBlocks()
  if (!selected.length) return
  const allCommented = selected.every((block) => block.comment === mode)
  const blocks = selected.map(({ name }) => name)
  void change({ kind: 'comment', blocks, comment: allCommented ? '' : mode })
}

/** Set the side of the names of the selected blocks. */
export function setNameSide(side: NonNullable<Place['name_side']>): void {
  void change({ kind: 'appearance', blocks: selectedBlocks().map(({ name }) => name), name_side: side })
}

/** Set the background of the selected blocks. */
export function setColour(colour: NonNullable<Place['colour']>): void {
  void change({ kind: 'appearance', blocks: selectedBlocks().map(({ name }) => name), colour })
}

/** Add Ground and Terminator blocks at the unconnected ports of the selected blocks, else of the sheet. */
export function ground(): void {
  void change({ kind: 'ground', blocks: selectedBlocks().map(({ name }) => name) })
}

/** Move the selected blocks into a new subsystem. */
export function group(): void {
  const { document, selection } = useStudio.getState()
  const selected = selectedBlocks()
  if (!document || !selected.length) return
  const name = freeName('Subsystem', namesInUse())
  void change({ kind: 'group', blocks: selected.map((block) => block.name), name }).then(
    (version) => version !== undefined && selectIfUnchanged(selection, [name]),
  )
}
