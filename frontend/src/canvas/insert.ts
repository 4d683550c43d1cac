import type { Place, Wire } from '../protocol'
import { change, freeName, useStudio } from '../store'

/** Drag data from the library: a block type. */
export const BLOCK_TYPE = 'application/x-armblocks-block'

/** Grid of block positions, px. */
export const GRID = 5

/**
 * Add a new block of a type with its centre at a point, and insert it into a wire if one is given; the block
 * is then selected.
 */
export function insertBlock(type: string, at: { x: number; y: number }, wire?: Wire): void {
  const { document, library, select } = useStudio.getState()
  const kind = library.get(type)
  if (!document || !kind) return
  const name = freeName(kind.title.replace(/[/.]/g, ' '), Object.keys(document.blocks))
  const place: Place = {
    x: GRID * Math.round((at.x - kind.width / 2) / GRID),
    y: wire ? at.y - kind.height / 2 : GRID * Math.round((at.y - kind.height / 2) / GRID),
  }
  const [input, output] = [kind.inputs[0], kind.outputs[0]]
  const between = wire && input && output
  void change({
    kind: 'add',
    blocks: [{ name, type, place }],
    wires: between
      ? [
          { source: wire.source, target: `${name}/${input}` },
          { source: `${name}/${output}`, target: wire.target },
        ]
      : [],
    instead: between ? [wire] : [],
  }).then(() => select([name]))
}
