/**
 * Orthogonal wires around blocks: a sparse grid, A* with a price for bends, nets that share their stem. The
 * prices are those of `drawing/wire_routing.py`, so that a report draws a sheet much as the canvas does. Each
 * net has a grid of its own over the window that it needs, so the work for one wire does not grow with the
 * sheet.
 */

export type Point = readonly [x: number, y: number]

/** A block and the area of its name, which wires avoid if possible. */
export interface Obstacle {
  x: number
  y: number
  width: number
  height: number
  label: readonly [x: number, y: number, width: number, height: number]
}

/** The end of a wire at a block, and the direction of the signal. */
export interface WireEnd {
  x: number
  y: number
  dx: number
  dy: number
}

export interface Net {
  key: string
  source: WireEnd
  /** `bends`: the way that somebody has drawn, see `bent`. */
  targets: { key: string; end: WireEnd; bends?: readonly number[] | undefined }[]
}

/** Corner points of the path to each target, by the target's key, and the dots where wires branch. */
export interface RoutedNet {
  paths: Map<string, Point[]>
  dots: Point[]
}

interface Segment {
  net: string
  a: Point
  b: Point
}

const CLEARANCE = 8
const STUB = 13
const LANES = [13, 23, 33]
const BEND = 34
const BRANCH = 20
const CROSSING = 26
const NEAR = 7
const NEAR_PRICE = 3
const LABEL_PRICE = 9
const WINDOW = 260
const MOST_NODES = 60_000

/**
 * The corner points of a way along `bends`, the coordinates of its straight pieces in turn (px): of a wire
 * that leaves to the side x, y, x … The first and the last piece go with their ports. `null` without bends,
 * or where the last piece would not run in the direction of its port. The same as in
 * `drawing/wire_routing.py`.
 */
export function bent(source: WireEnd, bends: readonly number[], target: WireEnd): Point[] | null {
  let [x, y] = [source.x, source.y]
  let flat = source.dx !== 0
  const points: Point[] = [[x, y]]
  for (const value of bends) {
    if (flat) x = value
    else y = value
    points.push([x, y])
    flat = !flat
  }
  if (!bends.length || flat !== (target.dx === 0)) return null
  points.push(flat ? [target.x, y] : [x, target.y], [target.x, target.y])
  return corners(points)
}

function drawnWays({ source, targets }: Net): Map<string, Point[]> {
  const found = new Map<string, Point[]>()
  for (const { key, end, bends } of targets) {
    const path = bends && bent(source, bends, end)
    if (path) found.set(key, path)
  }
  return found
}

const ahead = (end: WireEnd): Point => [end.x + STUB * end.dx, end.y + STUB * end.dy]
const behind = (end: WireEnd): Point => [end.x - STUB * end.dx, end.y - STUB * end.dy]

/**
 * Wires for the nets given, the short ones first, around `obstacles` and what `kept` nets have laid already.
 */
export function route(
  obstacles: Obstacle[],
  nets: Net[],
  kept: Map<string, RoutedNet> = new Map(),
): Map<string, RoutedNet> {
  const laid: Segment[] = []
  for (const [key, routed] of kept) for (const path of routed.paths.values()) lay(laid, key, path)
  const done = new Map<string, RoutedNet>()
  const order = nets
    .map((net) => ({ net, free: Number(drawnWays(net).size === 0), length: spread(net) }))
    .sort((a, b) => a.free - b.free || a.length - b.length || (a.net.key < b.net.key ? -1 : 1))
  for (const { net } of order) {
    const plainly = straight(net, obstacles, laid)
    const routed = plainly
      ? { paths: new Map([[net.targets[0]!.key, plainly]]), dots: [] }
      : new NetRouter(net, obstacles, laid).routed()
    for (const path of routed.paths.values()) lay(laid, net.key, path)
    done.set(net.key, routed)
  }
  return done
}

function lay(laid: Segment[], net: string, path: Point[]): void {
  for (let k = 1; k < path.length; k++) laid.push({ net, a: path[k - 1]!, b: path[k]! })
}

const spread = ({ source, targets }: Net) =>
  targets.reduce((sum, { end }) => sum + Math.abs(source.x - end.x) + Math.abs(source.y - end.y), 0)

const DIRECTIONS = [
  [0, 1],
  [1, 0],
  [0, -1],
  [-1, 0],
] as const

class NetRouter {
  private readonly xs: number[]
  private readonly ys: number[]
  private readonly columns: number
  private readonly right: Float64Array
  private readonly down: Float64Array
  private readonly crossRight: Uint8Array
  private readonly crossDown: Uint8Array
  private readonly drawn: Map<string, Point[]>

  constructor(
    private readonly net: Net,
    obstacles: Obstacle[],
    laid: Segment[],
  ) {
    const ends = [net.source, ...net.targets.map((target) => target.end)]
    const stubs = [ahead(net.source), ...net.targets.map((target) => behind(target.end))]
    this.drawn = drawnWays(net)
    const turns = [...this.drawn.values()].flatMap((path) => path.slice(1, -1))
    const [allX, allY] = [
      [...ends.map((e) => e.x), ...turns.map(([x]) => x)],
      [...ends.map((e) => e.y), ...turns.map(([, y]) => y)],
    ]
    const left = Math.min(...allX) - WINDOW
    const far = Math.max(...allX) + WINDOW
    const top = Math.min(...allY) - WINDOW
    const low = Math.max(...allY) + WINDOW
    const near = obstacles.filter(
      (o) => o.x < far && o.x + o.width > left && o.y < low && o.y + o.height > top,
    )
    const others = laid.filter(
      ({ net: key, a, b }) =>
        key !== net.key &&
        Math.min(a[0], b[0]) < far &&
        Math.max(a[0], b[0]) > left &&
        Math.min(a[1], b[1]) < low &&
        Math.max(a[1], b[1]) > top,
    )
    // A window with many blocks gets fewer lanes, to limit the search.
    const lanes = near.length > 60 ? LANES.slice(0, 1) : LANES
    this.xs = merged(
      [...stubs, ...turns].map(([x]) => x),
      near
        .flatMap((o) => lanes.flatMap((lane) => [o.x - lane, o.x + o.width + lane]))
        .filter((x) => x > left && x < far),
    )
    this.ys = merged(
      [...stubs, ...turns].map(([, y]) => y),
      near
        .flatMap((o) => lanes.flatMap((lane) => [Math.min(o.y, o.label[1]) - lane, bottom(o) + lane - 5]))
        .filter((y) => y > top && y < low),
    )
    this.columns = this.xs.length
    const nodes = Math.min(this.columns * this.ys.length, MOST_NODES)
    this.right = new Float64Array(nodes).fill(1)
    this.down = new Float64Array(nodes).fill(1)
    this.crossRight = new Uint8Array(nodes)
    this.crossDown = new Uint8Array(nodes)
    if (this.columns * this.ys.length > MOST_NODES) return
    for (const obstacle of near) this.block(obstacle)
    for (const segment of others) this.occupy(segment)
  }

  routed(): RoutedNet {
    const { net } = this
    const paths = new Map<string, Point[]>()
    const start = this.node(ahead(net.source))
    const tree = new Map<number, Set<number>>([[start, new Set()]])
    for (const [key, path] of this.drawn) {
      paths.set(key, path)
      this.follow(tree, path)
    }
    const goals = [...net.targets].sort((a, b) => distance(net.source, a.end) - distance(net.source, b.end))
    const ending = new Set<number>()
    for (const { key, end } of goals) {
      if (this.drawn.has(key)) continue
      const goal = this.node(behind(end))
      const walked = this.columns * this.ys.length > MOST_NODES ? null : this.search(tree, start, goal, end)
      if (!walked) {
        paths.set(
          key,
          corners([[net.source.x, net.source.y], ...plain(ahead(net.source), behind(end)), [end.x, end.y]]),
        )
        continue
      }
      for (let k = 1; k < walked.length; k++) {
        const [a, b] = [walked[k - 1]!, walked[k]!]
        link(tree, a, b)
        link(tree, b, a)
      }
      ending.add(goal)
      const points: Point[] = walked.map((node) => this.point(node))
      if (walked[0] === start) points.unshift([net.source.x, net.source.y])
      points.push([end.x, end.y])
      paths.set(key, corners(points))
    }
    const dots: Point[] = []
    for (const [node, joined] of tree)
      if (joined.size + Number(node === start) + Number(ending.has(node)) > 2) dots.push(this.point(node))
    return { paths, dots }
  }

  /** Make a drawn way part of the tree, so that others can branch from it. */
  private follow(tree: Map<number, Set<number>>, path: Point[]): void {
    const { source } = this.net
    const free = (path[1]![0] - source.x) * source.dx + (path[1]![1] - source.y) * source.dy >= STUB
    const turns = [...(free ? [ahead(source)] : []), ...path.slice(1, -1)].map((point) => this.node(point))
    for (let k = 1; k < turns.length; k++) {
      const [from, to] = [turns[k - 1]!, turns[k]!]
      const stride = Math.floor(from / this.columns) === Math.floor(to / this.columns) ? 1 : this.columns
      const way = to > from ? stride : -stride
      for (let node = from; node !== to; node += way) {
        link(tree, node, node + way)
        link(tree, node + way, node)
      }
    }
  }

  private node([x, y]: Point): number {
    return this.ys.indexOf(y) * this.columns + this.xs.indexOf(x)
  }

  private point(node: number): Point {
    return [this.xs[node % this.columns]!, this.ys[Math.floor(node / this.columns)]!]
  }

  private block(o: Obstacle): void {
    const forbid = (x0: number, y0: number, x1: number, y1: number, price: number) => {
      // Only the lines that meet the rectangle, and the last one before it, whose steps lead into it.
      for (let r = Math.max(after(this.ys, y0) - 1, 0); r < this.ys.length; r++) {
        const y = this.ys[r]!
        if (y >= y1) break
        const nextY = this.ys[r + 1] ?? Infinity
        for (let c = Math.max(after(this.xs, x0) - 1, 0); c < this.columns; c++) {
          const x = this.xs[c]!
          if (x >= x1) break
          const nextX = this.xs[c + 1] ?? Infinity
          const k = r * this.columns + c
          if (y > y0 && y < y1 && nextX > x0 && x < x1) this.right[k]! *= price
          if (x > x0 && x < x1 && nextY > y0 && y < y1) this.down[k]! *= price
        }
      }
    }
    forbid(o.x - CLEARANCE, o.y - CLEARANCE, o.x + o.width + CLEARANCE, o.y + o.height + CLEARANCE, Infinity)
    const [lx, ly, lw, lh] = o.label
    if (lw > 0) forbid(lx - 3, ly, lx + lw + 3, ly + lh, 1 + LABEL_PRICE)
  }

  /** Another net's wire: overlap is forbidden, adjacency and crossings are expensive. */
  private occupy({ a, b }: Segment): void {
    const flat = a[1] === b[1]
    const [along, across] = flat ? [this.xs, this.ys] : [this.ys, this.xs]
    const [from, to] = flat
      ? [Math.min(a[0], b[0]), Math.max(a[0], b[0])]
      : [Math.min(a[1], b[1]), Math.max(a[1], b[1])]
    const level = flat ? a[1] : a[0]
    for (let m = 0; m < across.length; m++) {
      const gap = Math.abs(across[m]! - level)
      if (gap < NEAR)
        for (let k = 0; k < along.length; k++) {
          if ((along[k + 1] ?? Infinity) <= from || along[k]! >= to) continue
          const index = flat ? m * this.columns + k : k * this.columns + m
          const price = gap < 0.5 ? Infinity : NEAR_PRICE
          if (flat) this.right[index]! *= price
          else this.down[index]! *= price
        }
      // Steps that pass over the level cross the wire.
      const next = across[m + 1]
      if (next !== undefined && across[m]! <= level && next > level)
        for (let k = 0; k < along.length; k++) {
          if (along[k]! < from || along[k]! > to) continue
          if (flat) this.crossDown[m * this.columns + k] = 1
          else this.crossRight[k * this.columns + m] = 1
        }
    }
  }

  private search(
    tree: Map<number, Set<number>>,
    start: number,
    goal: number,
    target: WireEnd,
  ): number[] | null {
    const [gx, gy] = this.point(goal)
    const guess = (node: number) => {
      const [x, y] = this.point(node)
      return Math.abs(x - gx) + Math.abs(y - gy)
    }
    const heading = direction(this.net.source)
    const arriving = direction(target)
    const best = new Map<number, number>()
    const came = new Map<number, number>()
    const queue = new Queue()
    for (const node of tree.keys())
      for (let k = 0; k < 4; k++) {
        const price = node !== start ? BRANCH : k === heading ? 0 : BEND
        best.set(node * 4 + k, price)
        queue.push(price + guess(node), price, node * 4 + k)
      }
    for (let item = queue.pop(); item; item = queue.pop()) {
      const { cost, state } = item
      if (cost > best.get(state)!) continue
      const node = state >> 2
      const k = state & 3
      if (node === goal && k === arriving) return walk(came, state)
      for (const turn of [0, 1, 3]) {
        const next = turn ? state - k + ((k + turn) % 4) : this.step(node, k)
        if (next < 0) continue
        const price = cost + (turn ? BEND : this.price(node, k))
        if (price < (best.get(next) ?? Infinity) - 1e-9) {
          best.set(next, price)
          came.set(next, state)
          queue.push(price + guess(next >> 2), price, next)
        }
      }
    }
    return null
  }

  private step(node: number, k: number): number {
    const [dr, dc] = DIRECTIONS[k]!
    const r = Math.floor(node / this.columns) + dr
    const c = (node % this.columns) + dc
    if (r < 0 || c < 0 || r >= this.ys.length || c >= this.columns) return -1
    return this.price(node, k) === Infinity ? -1 : (r * this.columns + c) * 4 + k
  }

  private price(node: number, k: number): number {
    const [dr, dc] = DIRECTIONS[k]!
    const edge = node - (dr < 0 ? this.columns : 0) - (dc < 0 ? 1 : 0)
    if (dr === 0) {
      const c = edge % this.columns
      return this.right[edge]! * (this.xs[c + 1]! - this.xs[c]!) + (this.crossRight[edge] ? CROSSING : 0)
    }
    const r = Math.floor(edge / this.columns)
    return this.down[edge]! * (this.ys[r + 1]! - this.ys[r]!) + (this.crossDown[edge] ? CROSSING : 0)
  }
}

/** Index of the first value that is greater than `limit`, in values that ascend. */
function after(values: number[], limit: number): number {
  let [low, high] = [0, values.length]
  while (low < high) {
    const half = (low + high) >> 1
    if (values[half]! > limit) high = half
    else low = half + 1
  }
  return low
}

/**
 * The way of a net with one end straight ahead, where nothing stands or lies near it: no other way is
 * cheaper.
 */
function straight({ source, targets }: Net, obstacles: Obstacle[], laid: Segment[]): Point[] | null {
  const [only] = targets
  if (!only || targets.length > 1 || only.bends) return null
  const { end } = only
  const along = (end.x - source.x) * source.dx + (end.y - source.y) * source.dy
  const level = source.dx ? end.y === source.y : end.x === source.x
  if (!level || along < 2 * STUB || end.dx !== source.dx || end.dy !== source.dy) return null
  const [left, right] = [Math.min(source.x, end.x), Math.max(source.x, end.x)]
  const [top, low] = [Math.min(source.y, end.y), Math.max(source.y, end.y)]
  const meets = (x0: number, y0: number, x1: number, y1: number) =>
    x0 < right && x1 > left && y0 < low + 0.5 && y1 > top - 0.5
  const blocked = ({ x, y, width, height, label: [lx, ly, lw, lh] }: Obstacle) =>
    (meets(x - CLEARANCE, y - CLEARANCE, x + width + CLEARANCE, y + height + CLEARANCE) &&
      !touches(x, y, width, height, source) &&
      !touches(x, y, width, height, end)) ||
    (lw > 0 && meets(lx - 3, ly, lx + lw + 3, ly + lh))
  if (obstacles.some(blocked)) return null
  const near = ({ a, b }: Segment) =>
    meets(
      Math.min(a[0], b[0]) - NEAR,
      Math.min(a[1], b[1]) - NEAR,
      Math.max(a[0], b[0]) + NEAR,
      Math.max(a[1], b[1]) + NEAR,
    )
  return laid.some(near)
    ? null
    : [
        [source.x, source.y],
        [end.x, end.y],
      ]
}

const touches = (x: number, y: number, width: number, height: number, at: WireEnd) =>
  at.x >= x - 0.5 && at.x <= x + width + 0.5 && at.y >= y - 0.5 && at.y <= y + height + 0.5

const direction = ({ dx, dy }: WireEnd) => DIRECTIONS.findIndex(([dr, dc]) => dr === dy && dc === dx)
const bottom = (o: Obstacle) => Math.max(o.y + o.height, o.label[1] + o.label[3])
const distance = (a: WireEnd, b: WireEnd) => Math.abs(a.x - b.x) + Math.abs(a.y - b.y)

/** If blocks are too close for the grid, a simple step is better than no wire. */
const plain = (a: Point, b: Point): Point[] => [a, [(a[0] + b[0]) / 2, a[1]], [(a[0] + b[0]) / 2, b[1]], b]

function link(tree: Map<number, Set<number>>, a: number, b: number): void {
  const joined = tree.get(a)
  if (joined) joined.add(b)
  else tree.set(a, new Set([b]))
}

function walk(came: Map<number, number>, end: number): number[] {
  const nodes: number[] = []
  for (let state: number | undefined = end; state !== undefined; state = came.get(state))
    if (nodes.at(-1) !== state >> 2) nodes.push(state >> 2)
  return nodes.reverse()
}

/** All exact coordinates, and of the wanted ones those that are not almost there already. */
function merged(exact: number[], wanted: number[]): number[] {
  const kept = [...new Set(exact)].sort((a, b) => a - b)
  const all = [...kept]
  let last = -Infinity
  for (const value of [...new Set(wanted)].sort((a, b) => a - b)) {
    if (value - last < 4 || kept.some((other) => Math.abs(value - other) < 4)) continue
    all.push(value)
    last = value
  }
  return all.sort((a, b) => a - b)
}

/** The points without repetitions and without those on a straight line between their neighbours. */
export function corners(points: Point[]): Point[] {
  const kept: Point[] = []
  for (const point of points) {
    const last = kept.at(-1)
    if (last && last[0] === point[0] && last[1] === point[1]) continue
    const before = kept.at(-2)
    if (
      last &&
      before &&
      ((before[0] === last[0] && last[0] === point[0]) || (before[1] === last[1] && last[1] === point[1]))
    )
      kept[kept.length - 1] = point
    else kept.push(point)
  }
  return kept
}

/** A binary heap of states by estimated price. */
class Queue {
  private readonly items: { rank: number; cost: number; state: number }[] = []

  push(rank: number, cost: number, state: number): void {
    const { items } = this
    let k = items.push({ rank, cost, state }) - 1
    while (k > 0) {
      const up = (k - 1) >> 1
      if (items[up]!.rank <= items[k]!.rank) break
      ;[items[up], items[k]] = [items[k]!, items[up]!]
      k = up
    }
  }

  pop(): { rank: number; cost: number; state: number } | undefined {
    const { items } = this
    const first = items[0]
    const last = items.pop()
    if (!first || !last || items.length === 0) return first
    items[0] = last
    for (let k = 0; ;) {
      let least = k
      for (const child of [2 * k + 1, 2 * k + 2])
        if (child < items.length && items[child]!.rank < items[least]!.rank) least = child
      if (least === k) return first
      ;[items[least], items[k]] = [items[k]!, items[least]!]
      k = least
    }
  }
}

const ROUNDING = 5

/** The path as SVG: straight pieces with small round corners. */
export function svgPath(points: readonly Point[]): string {
  const [first] = points
  if (!first) return ''
  let text = `M${first[0]} ${first[1]}`
  for (let k = 1; k < points.length - 1; k++) {
    const [before, corner, after] = [points[k - 1]!, points[k]!, points[k + 1]!]
    const radius = Math.min(ROUNDING, length(before, corner) / 2, length(corner, after) / 2)
    const [ax, ay] = towards(corner, before, radius)
    const [bx, by] = towards(corner, after, radius)
    text += `L${ax} ${ay}Q${corner[0]} ${corner[1]} ${bx} ${by}`
  }
  const last = points.at(-1)!
  return `${text}L${last[0]} ${last[1]}`
}

const length = (a: Point, b: Point) => Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1])

function towards(a: Point, b: Point, by: number): Point {
  const share = by / (length(a, b) || 1)
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share]
}
