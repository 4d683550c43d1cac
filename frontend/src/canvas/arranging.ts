import type { Place, SheetBlock } from '../protocol'
import { change, freeName, takenNames, useStudio } from '../store'

/** Commands on all selected blocks: each is one undo step. */

export function chosenBlocks(): SheetBlock[] {
  const { document, selection } = useStudio.getState()
  return [...selection].map((name) => document?.blocks[name]).filter((block) => block !== undefined)
}

function place(change_: (block: SheetBlock) => Partial<Place>): void {
  const chosen = chosenBlocks()
  const places = Object.fromEntries(
    chosen.map((block) => [block.name, { ...block.place, ...change_(block) }]),
  )
  const same = chosen.every((block) => JSON.stringify(places[block.name]) === JSON.stringify(block.place))
  if (!same) void change({ kind: 'move', places })
}

export const flip = (): void => place(({ place }) => ({ flipped: !place.flipped }))

export function rotate(): void {
  place(({ place }) => ({ rotation: (((place.rotation ?? 0) + 90) % 360) as 0 | 90 | 180 | 270 }))
}

export const shift = (dx: number, dy: number): void =>
  place(({ place }) => ({ x: place.x + dx, y: place.y + dy }))

export type Edge = 'left' | 'centre' | 'right' | 'top' | 'middle' | 'bottom'

const right = ({ place, width }: SheetBlock) => place.x + width
const bottom = ({ place, height }: SheetBlock) => place.y + height

/** Align the selected blocks: by an edge or by their centres. */
export function align(edge: Edge): void {
  const chosen = chosenBlocks()
  const [left, far] = [Math.min(...chosen.map(({ place }) => place.x)), Math.max(...chosen.map(right))]
  const [top, low] = [Math.min(...chosen.map(({ place }) => place.y)), Math.max(...chosen.map(bottom))]
  const to: Record<Edge, (block: SheetBlock) => Partial<Place>> = {
    left: () => ({ x: left }),
    centre: ({ width }) => ({ x: (left + far - width) / 2 }),
    right: ({ width }) => ({ x: far - width }),
    top: () => ({ y: top }),
    middle: ({ height }) => ({ y: (top + low - height) / 2 }),
    bottom: ({ height }) => ({ y: low - height }),
  }
  place(to[edge])
}

/** Make the gaps between the selected blocks equal; the outer two blocks do not move. */
export function distribute(axis: 'x' | 'y'): void {
  const size = axis === 'x' ? 'width' : 'height'
  const chosen = chosenBlocks().sort((a, b) => a.place[axis] - b.place[axis])
  const [first, last] = [chosen[0], chosen.at(-1)]
  if (!first || !last || chosen.length < 3) return
  const room = last.place[axis] + last[size] - first.place[axis]
  const gap = (room - chosen.reduce((sum, block) => sum + block[size], 0)) / (chosen.length - 1)
  const at = new Map<string, number>()
  let next = first.place[axis]
  for (const block of chosen) {
    at.set(block.name, next)
    next += block[size] + gap
  }
  place(({ name }) => ({ [axis]: at.get(name) }))
}

/** Comment the selected blocks out or through; if all of them are so already, remove their comments. */
export function comment(how: 'out' | 'through'): void {
  const chosen = chosenBlocks()
  if (!chosen.length) return
  const already = chosen.every((block) => block.comment === how)
  const blocks = chosen.map(({ name }) => name)
  void change({ kind: 'comment', blocks, comment: already ? '' : how })
}

/** Set the side of the names of the selected blocks. */
export function setNameSide(side: NonNullable<Place['name_side']>): void {
  void change({ kind: 'appearance', blocks: chosenBlocks().map(({ name }) => name), name_side: side })
}

/** Set the background of the selected blocks. */
export function setColour(colour: NonNullable<Place['colour']>): void {
  void change({ kind: 'appearance', blocks: chosenBlocks().map(({ name }) => name), colour })
}

/** Add Ground and Terminator blocks at the unconnected ports of the selected blocks, else of the sheet. */
export function ground(): void {
  void change({ kind: 'ground', blocks: chosenBlocks().map(({ name }) => name) })
}

/** Move the selected blocks into a new subsystem. */
export function group(): void {
  const { document, select } = useStudio.getState()
  const chosen = chosenBlocks()
  if (!document || !chosen.length) return
  const name = freeName('Subsystem', takenNames())
  void change({ kind: 'group', blocks: chosen.map((block) => block.name), name }).then(() => select([name]))
}
