import { faceMarks, type FaceMark, type FaceText } from '../model/face_marks'
import type { Rectangle } from '../model/free_place'
import { svgPath, type Point } from '../model/wire_lines'
import type { SheetBlock } from '../protocol'
import type { BlockNodeType } from './block_node'
import type { NoteNodeType } from './note_node'
import type { SheetNode } from './sheet_graph'
import { MAX_NAME_WIDTH, nameWidth } from './sheet_layout'
import type { WireEdgeType } from './wire_edge'

/** The name of a signal at its line. */
export interface PlacedName {
  text: string
  x: number
  y: number
  anchor: 'start' | 'middle'
  propagated: boolean
}

/** A value at a line, or in a block, which has a fixed width, px. `x` is its left or right edge. */
export interface PlacedValue {
  text: string
  x: number
  y: number
  align: 'left' | 'right'
  /** The magnification of the label. */
  scale: number
  width?: number
}

/** The displayed parts of a sheet. */
export interface SheetContent {
  nodes: SheetNode[]
  edges: WireEdgeType[]
  names: PlacedName[]
  values: PlacedValue[]
}

/** Colours and fonts of the sheet, by the names of their CSS variables. */
export type Style = (name: string) => string

/** Smaller texts are drawn as bars, px on the screen. */
const MIN_TEXT = 2.5
/** Average width of a letter, relative to the size of the text. */
const LETTER = 0.55
/** Distance around a block within which its name, ports and marks are, px. */
const AROUND_BLOCK = 190
const LINE_WIDTHS = [1.2, 2.3, 3.8, 5.4]
/** Width of a frame line, px. */
const FRAME_LINE = 1.8
/** Lines inside a line of rank 2 or 3: colour and width, px. */
const CORES: [rank: number, colour: string, width: number][] = [
  [2, 'page', 1.5],
  [3, 'page', 3.2],
  [3, 'wire', 1],
]
const TAU = 2 * Math.PI

/** A part of a face, prepared for drawing. */
type Drawable = { mark: FaceMark; path: Path2D | null }

/** Draws sheets on canvases as the page shows them. Paths are kept for the next picture. */
export class SheetPainter {
  private readonly faces = new Map<string, Drawable[]>()
  private readonly lines = new WeakMap<readonly Point[], Path2D>()

  /** Draw the region of a sheet with `scale` pixels per px. */
  draw(
    context: CanvasRenderingContext2D,
    { nodes, edges, names, values }: SheetContent,
    region: Rectangle,
    scale: number,
    nameScale: number,
    style: Style,
  ): void {
    const origin = new Origin(context, region, scale)
    origin.move(0, 0)
    const visible = (node: SheetNode) => touches(region, node)
    for (const edge of edges) if (edge.data?.path.length) this.wire(context, edge, style)
    for (const node of nodes)
      if (node.type === 'block' && visible(node)) this.block(origin, node, nameScale, style)
    origin.move(0, 0)
    for (const node of nodes) if (node.type === 'note') note(context, node, scale, style)
    for (const edge of edges) for (const tag of edge.data?.tags ?? []) wireTag(context, tag, scale, style)
    for (const name of names) signalName(context, name, scale, style)
    for (const value of values) shownValue(context, value, scale, style)
  }

  private wire(context: CanvasRenderingContext2D, { data, selected, className }: WireEdgeType, style: Style) {
    const { path, dots, rank, pending, frame } = data!
    const colour = frame ? 'trace-2' : 'wire'
    let line = this.lines.get(path)
    if (!line) this.lines.set(path, (line = new Path2D(svgPath(path, dots))))
    const into = className === 'into'
    context.strokeStyle = style(selected || into ? 'accent' : colour)
    context.lineWidth = into ? 3 : rank === 0 && selected ? 2 : frame ? FRAME_LINE : LINE_WIDTHS[rank]!
    if (pending) context.setLineDash([5, 4])
    context.stroke(line)
    context.setLineDash([])
    context.fillStyle = style(selected ? 'accent' : colour)
    if (!frame) arrowHead(context, path)
    for (const [at, core, width] of CORES)
      if (at === rank) {
        context.strokeStyle = style(core)
        context.lineWidth = width
        context.stroke(line)
      }
    for (const [x, y] of dots) disc(context, x, y, 2.6 + 0.3 * rank)
  }

  private block(origin: Origin, node: BlockNodeType, nameScale: number, style: Style): void {
    const { context, scale } = origin
    const { block, findings } = node.data
    const { width, height } = block
    origin.move(node.position.x, node.position.y)
    for (const { mark, path } of this.face(block.face))
      if (mark.kind === 'text') faceText(context, mark, scale, style)
      else if (path) {
        context.globalAlpha = mark.opacity
        context.lineCap = mark.round ? 'round' : 'butt'
        context.lineJoin = mark.round ? 'round' : 'miter'
        context.setLineDash(mark.dash)
        if (mark.fill) {
          context.fillStyle = style(mark.fill)
          context.fill(path)
        }
        if (mark.stroke) {
          context.strokeStyle = style(mark.stroke)
          context.lineWidth = mark.strokeWidth
          context.stroke(path)
        }
      }
    context.setLineDash([])
    context.globalAlpha = 1
    blockName(context, block, scale, nameScale, style)
    for (const { port, severity } of findings) {
      const place = block.inputs.find(({ name }) => name === port)
      if (place) portMark(context, place.x, place.y, severity === 'error', style)
    }
    if (node.selected) {
      context.strokeStyle = style('accent')
      context.lineWidth = 2
      context.beginPath()
      context.roundRect(-2, -2, width + 4, height + 4, 7)
      context.stroke()
    }
    if (findings.some(({ severity }) => severity === 'error')) {
      context.fillStyle = style('error')
      disc(context, width, 0, 7)
    }
  }

  private face(face: string): Drawable[] {
    let drawables = this.faces.get(face)
    if (!drawables) {
      drawables = faceMarks(face).map((mark) => ({
        mark,
        path: mark.kind === 'shape' ? new Path2D(mark.path) : null,
      }))
      this.faces.set(face, drawables)
    }
    return drawables
  }
}

/** Moves the origin of a canvas to places of the sheet. */
class Origin {
  constructor(
    readonly context: CanvasRenderingContext2D,
    private readonly region: Rectangle,
    readonly scale: number,
  ) {}

  move(x: number, y: number): void {
    const { region, scale } = this
    this.context.setTransform(scale, 0, 0, scale, scale * (x - region.x), scale * (y - region.y))
  }
}

function touches({ x, y, width, height }: Rectangle, { position, ...node }: SheetNode): boolean {
  const [w, h] = [node.width ?? 0, node.height ?? 0]
  return (
    position.x - AROUND_BLOCK < x + width &&
    position.x + w + AROUND_BLOCK > x &&
    position.y - AROUND_BLOCK < y + height &&
    position.y + h + AROUND_BLOCK > y
  )
}

function disc(context: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  context.beginPath()
  context.arc(x, y, radius, 0, TAU)
  context.fill()
}

/** The head of a wire, as the marker of its line. */
function arrowHead(context: CanvasRenderingContext2D, path: readonly Point[]): void {
  const [[ax, ay], [x, y]] = [path.at(-2)!, path.at(-1)!]
  const [dx, dy] = [Math.sign(x - ax), Math.sign(y - ay)]
  context.beginPath()
  context.moveTo(x, y)
  context.lineTo(x - 8 * dx + 3.7 * dy, y - 8 * dy + 3.7 * dx)
  context.lineTo(x - 8 * dx - 3.7 * dy, y - 8 * dy - 3.7 * dx)
  context.fill()
}

function portMark(context: CanvasRenderingContext2D, x: number, y: number, faulty: boolean, style: Style) {
  context.fillStyle = style(faulty ? 'error' : 'page')
  disc(context, x, y, faulty ? 4.5 : 3.6)
  if (faulty) return
  context.strokeStyle = style('warning')
  context.lineWidth = 1.2
  context.beginPath()
  context.arc(x, y, 3, 0, TAU)
  context.stroke()
}

interface Line {
  text: string
  x: number
  y: number
  size: number
  align: CanvasTextAlign
  baseline?: CanvasTextBaseline
}

/** A text in the present colour and font; a bar where the text is too small to be read. */
function write(
  context: CanvasRenderingContext2D,
  { text, x, y, size, align, baseline }: Line,
  scale: number,
) {
  if (size * scale < MIN_TEXT) {
    const width = LETTER * size * text.length
    const left = align === 'center' ? x - width / 2 : align === 'right' ? x - width : x
    const { globalAlpha } = context
    context.globalAlpha = 0.3 * globalAlpha
    context.fillRect(left, baseline === 'middle' ? y - 0.3 * size : y - 0.65 * size, width, 0.6 * size)
    context.globalAlpha = globalAlpha
    return
  }
  context.textAlign = align
  context.textBaseline = baseline ?? 'alphabetic'
  context.fillText(text, x, y)
}

const ALIGNMENTS = { start: 'left', middle: 'center', end: 'right' } as const

function faceText(context: CanvasRenderingContext2D, mark: FaceText, scale: number, style: Style): void {
  const { x, y, size, text, upright } = mark
  context.fillStyle = style(mark.fill)
  const font = style(mark.mono ? 'mono' : 'font')
  context.font = `${mark.italic ? 'italic ' : ''}${mark.bold ? '600 ' : ''}${size}px ${font}`
  const line = { text, x: upright ? 0 : x, y: upright ? 0 : y, size, align: ALIGNMENTS[mark.anchor] }
  if (!upright) return write(context, line, scale)
  const transform = context.getTransform()
  context.translate(x, y)
  context.rotate(-TAU / 4)
  write(context, line, scale)
  context.setTransform(transform)
}

function blockName(
  context: CanvasRenderingContext2D,
  { name, shown_name_side: side, width, height }: SheetBlock,
  scale: number,
  nameScale: number,
  style: Style,
): void {
  if (side === 'hidden') return
  const size = 11 * nameScale
  context.fillStyle = style('muted')
  context.font = `${size}px ${style('font')}`
  const middle = 7 * nameScale
  const [x, y, align] = (
    {
      below: [width / 2, height + 2 + middle, 'center'],
      above: [0, -16 + middle, 'left'],
      left: [-5, height / 2 - 7 + middle, 'right'],
      right: [width + 5, height / 2 - 7 + middle, 'left'],
      corner: [0.78 * width, -15 + middle, 'left'],
    } as const
  )[side]
  const text = nameWidth(name) < MAX_NAME_WIDTH ? name : shortened(context, name)
  write(context, { text, x, y, size, align, baseline: 'middle' }, scale)
}

/** The beginning of a long name, as far as there is room for it. */
function shortened(context: CanvasRenderingContext2D, name: string): string {
  if (context.measureText(name).width <= MAX_NAME_WIDTH) return name
  let length = name.length
  while (length > 1 && context.measureText(`${name.slice(0, length)}…`).width > MAX_NAME_WIDTH) length--
  return `${name.slice(0, length)}…`
}

function note(context: CanvasRenderingContext2D, node: NoteNodeType, scale: number, style: Style): void {
  context.fillStyle = style('ink')
  context.font = `12px ${style('font')}`
  const { x, y } = node.position
  for (const [k, text] of node.data.note.text.split('\n').entries())
    write(
      context,
      { text, x: x + 4, y: y + 2 + 17 * k + 8.5, size: 12, align: 'left', baseline: 'middle' },
      scale,
    )
}

/** Length of the stub from a port to the label of a wire without a line, px. */
const STUB = 8

type Tag = NonNullable<WireEdgeType['data']>['tags'][number]

function wireTag(
  context: CanvasRenderingContext2D,
  { x, y, dx, dy, text }: Tag,
  scale: number,
  style: Style,
) {
  const [tx, ty] = [x + STUB * dx, y + STUB * dy]
  context.font = `9px ${style('font')}`
  const width = context.measureText(text).width + 10
  const [left, top] = [tx + (width * (dx - 1)) / 2, ty + (14 * (dy - 1)) / 2]
  context.strokeStyle = style('wire')
  context.lineWidth = 1
  context.setLineDash([2.5, 2])
  context.beginPath()
  context.moveTo(x, y)
  context.lineTo(tx, ty)
  context.rect(left, top, width, 14)
  context.fillStyle = style('surface')
  context.fillRect(left, top, width, 14)
  context.stroke()
  context.setLineDash([])
  context.fillStyle = style('ink')
  write(context, { text, x: left + 5, y: top + 7, size: 9, align: 'left', baseline: 'middle' }, scale)
}

function signalName(context: CanvasRenderingContext2D, name: PlacedName, scale: number, style: Style): void {
  const { text, x, y, anchor, propagated } = name
  context.font = `italic 10px ${style('font')}`
  context.fillStyle = style(propagated ? 'muted' : 'ink')
  write(context, { text, x, y: y - 3.5, size: 10, align: ALIGNMENTS[anchor], baseline: 'middle' }, scale)
}

/** A value with its ground, as the class `wire-value` or `display-value` shows it. */
function shownValue(
  context: CanvasRenderingContext2D,
  value: PlacedValue,
  scale: number,
  style: Style,
): void {
  const { text, x, y, align, scale: magnification, width: fixedWidth } = value
  const [size, height, side] = fixedWidth ? [9.5, 11, 4] : [10, 14, 3].map((part) => part * magnification)
  context.font = `${size}px ${style('mono')}`
  const width = fixedWidth ?? context.measureText(text).width + 2 * side!
  context.fillStyle = style(fixedWidth ? 'sunken' : 'page')
  context.fillRect(align === 'left' ? x : x - width, y, width, height!)
  context.fillStyle = style(fixedWidth ? 'ink' : 'accent')
  const start = align === 'left' ? x + side! : x - side!
  write(context, { text, x: start, y: y + height! / 2, size: size!, align, baseline: 'middle' }, scale)
}
