import { Position, type FitViewOptions } from '@xyflow/react'
import type { PortSpot, SheetBlock, Wire } from '../protocol'
import { blockOf, portOf, wireKey, type Places } from '../model/wires'
import { route, type Net, type Obstacle, type RoutedNet, type WireEnd } from '../model/router'

const NAME_SIZE = 11
const NAME_FONT = `${NAME_SIZE}px 'Inter Variable', sans-serif`
const NAME_ROOM = 20
/** Maximum width of a name, px; longer names are cut. */
export const WIDEST_NAME = 168
/** Width and height of a port, px. */
export const PORT = 9

/** The side of a block at which a port is. */
export function side({ dx, dy }: PortSpot, output: boolean): Position {
  const [x, y] = output ? [dx, dy] : [-dx, -dy]
  return x > 0 ? Position.Right : x < 0 ? Position.Left : y > 0 ? Position.Bottom : Position.Top
}

let ruler: CanvasRenderingContext2D | null | undefined
const widths = new Map<string, number>()

/** Width of a block's name, px. */
export function nameWidth(name: string): number {
  const known = widths.get(name)
  if (known !== undefined) return known
  ruler ??= document.createElement('canvas').getContext('2d')
  if (!ruler) return 6 * name.length
  ruler.font = NAME_FONT
  const width = Math.min(ruler.measureText(name).width, WIDEST_NAME)
  // Before the page's font is loaded, a fallback font is measured.
  if (document.fonts.check(NAME_FONT)) widths.set(name, width)
  return width
}

/** The side of a block's name: one without wires, as in the drawings of reports. */
export function nameSide({ place, inputs, height }: SheetBlock): 'below' | 'beside' | 'above' {
  if ((place.rotation ?? 0) % 180 !== 0) return 'beside' // signals run from top to bottom
  return inputs.some(({ y }) => y >= height) ? 'above' : 'below' // wires enter a round sum from below
}

/**
 * How the sheet is fitted into its panel: nothing of it lies under the buttons at the left, and the lowest
 * names are seen.
 */
export const FIT: FitViewOptions = {
  padding: { top: '16px', right: '24px', bottom: '32px', left: '56px' },
  maxZoom: 1.25,
}

function obstacle(block: SheetBlock, at: { x: number; y: number }): Obstacle {
  const width = nameWidth(block.name)
  const labels = {
    beside: [at.x + block.width + 5, at.y + block.height / 2 - 8, width, NAME_ROOM - 4],
    above: [at.x + 0.78 * block.width, at.y - NAME_SIZE - 2, width, NAME_SIZE + 3],
    below: [at.x + (block.width - width) / 2, at.y + block.height + 2, width, NAME_ROOM - 4],
  } as const
  return {
    x: at.x,
    y: at.y,
    width: block.width,
    height: block.height,
    label: labels[nameSide(block)],
  }
}

function end(
  block: SheetBlock,
  at: { x: number; y: number },
  port: string,
  output: boolean,
): WireEnd | undefined {
  const spot = (output ? block.outputs : block.inputs).find(({ name }) => name === port)
  return spot && { x: at.x + spot.x, y: at.y + spot.y, dx: spot.dx, dy: spot.dy }
}

/**
 * The wires of a sheet. What was laid is kept as long as no end of the net moved and no block was put on its
 * way, so an edit costs what it touches and not the whole sheet.
 */
export class SheetRoutes {
  private routed = new Map<string, RoutedNet>()
  private nets = new Map<string, string>()
  private obstacles = new Map<string, string>()

  /** `loose`: a block that no wire goes around, because it is about to go into one. */
  update(
    blocks: Record<string, SheetBlock>,
    wires: Wire[],
    places: Places,
    loose: string | null,
  ): Map<string, RoutedNet> {
    const nets = collect(blocks, wires, places)
    const obstacles = new Map(
      Object.values(blocks)
        .filter(({ name }) => name !== loose)
        .map((block) => [block.name, obstacle(block, places[block.name] ?? block.place)]),
    )
    const moved: Obstacle[] = []
    const keys = new Map<string, string>()
    for (const [name, box] of obstacles) {
      const key = `${box.x} ${box.y} ${box.width} ${box.height}`
      keys.set(name, key)
      if (this.obstacles.get(name) !== key) moved.push(box)
    }
    this.obstacles = keys
    const kept = new Map<string, RoutedNet>()
    const fresh: Net[] = []
    const described = new Map<string, string>()
    for (const net of nets) {
      const description = JSON.stringify([net.source, net.targets])
      described.set(net.key, description)
      const old = this.routed.get(net.key)
      if (old && this.nets.get(net.key) === description && !moved.some((box) => crosses(old, box)))
        kept.set(net.key, old)
      else fresh.push(net)
    }
    this.nets = described
    const laid = fresh.length ? route([...obstacles.values()], fresh, kept) : new Map<string, RoutedNet>()
    this.routed = new Map([...kept, ...laid])
    return this.routed
  }
}

/** The offset of a wire's drawn route: it moves with its blocks while both are dragged together. */
function shift(from: SheetBlock, to: SheetBlock, places: Places): [number, number] {
  const [a, b] = [places[from.name], places[to.name]]
  if (!a || !b) return [0, 0]
  const [dx, dy] = [a.x - from.place.x, a.y - from.place.y]
  return b.x - to.place.x === dx && b.y - to.place.y === dy ? [dx, dy] : [0, 0]
}

function collect(blocks: Record<string, SheetBlock>, wires: Wire[], places: Places): Net[] {
  const nets = new Map<string, Net>()
  for (const wire of wires) {
    const from = blocks[blockOf(wire.source)]
    const to = blocks[blockOf(wire.target)]
    if (!from || !to) continue
    const source = end(from, places[from.name] ?? from.place, portOf(wire.source), true)
    const target = end(to, places[to.name] ?? to.place, portOf(wire.target), false)
    if (!source || !target) continue
    const bends = wire.bends?.length
      ? wire.bends.map((value, k) => value + shift(from, to, places)[(k + Number(source.dx === 0)) % 2]!)
      : undefined
    const net = nets.get(wire.source) ?? { key: wire.source, source, targets: [] }
    net.targets.push({ key: wireKey(wire), end: target, bends })
    nets.set(wire.source, net)
  }
  return [...nets.values()]
}

function crosses({ paths }: RoutedNet, box: Obstacle): boolean {
  const [left, right, top, low] = [box.x - 4, box.x + box.width + 4, box.y - 4, box.y + box.height + 4]
  for (const path of paths.values())
    for (let k = 1; k < path.length; k++) {
      const [a, b] = [path[k - 1]!, path[k]!]
      if (
        Math.max(a[0], b[0]) > left &&
        Math.min(a[0], b[0]) < right &&
        Math.max(a[1], b[1]) > top &&
        Math.min(a[1], b[1]) < low
      )
        return true
    }
  return false
}
