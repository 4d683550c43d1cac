/** The marks of a block's face, for drawing on a canvas. The server writes faces as SVG, see `svg.py`. */

interface Paint {
  /** Names of colours: `surface` is the CSS variable `--surface`. */
  fill: string | null
  stroke: string | null
  strokeWidth: number
  opacity: number
  dash: number[]
  /** Whether lines have round ends and corners. */
  round: boolean
}

/** A shape as the data of an SVG path. */
export interface Shape extends Paint {
  kind: 'shape'
  path: string
}

/** A text; `anchor` is the part of the text at its position. */
export interface FaceText {
  kind: 'text'
  x: number
  y: number
  size: number
  fill: string
  anchor: 'start' | 'middle' | 'end'
  mono: boolean
  bold: boolean
  italic: boolean
  /** Whether the text runs upwards. */
  upright: boolean
  text: string
}

export type FaceMark = Shape | FaceText

const ELEMENT = /<(rect|circle|path|text)\b([^>]*?)(?:\/>|>([^<]*)<\/\1>)/g
const ATTRIBUTE = /([a-z-]+)="([^"]*)"/g
const ENTITIES: Record<string, string> = { amp: '&', lt: '<', gt: '>', quot: '"', '#39': "'" }
const ANCHORS = { middle: 'middle', end: 'end' } as const

/** The marks of a face, from back to front. Images are omitted. */
export function faceMarks(face: string): FaceMark[] {
  return [...face.matchAll(ELEMENT)].map(([, kind, attributes, content = '']) => {
    const values = new Map([...attributes!.matchAll(ATTRIBUTE)].map(([, name, value]) => [name!, value!]))
    const number = (name: string, missing = 0) => Number(values.get(name) ?? missing)
    const classes = (values.get('class') ?? '').split(' ')
    const tone = (prefix: string) =>
      classes.find((name) => name.startsWith(prefix))?.slice(prefix.length) ?? null
    if (kind === 'text')
      return {
        kind,
        x: number('x'),
        y: number('y'),
        size: number('font-size', 12),
        fill: tone('f-') ?? 'ink',
        anchor: ANCHORS[values.get('text-anchor') as keyof typeof ANCHORS] ?? 'start',
        mono: classes.includes('m'),
        bold: values.has('font-weight'),
        italic: values.has('font-style'),
        upright: values.has('transform'),
        text: content.replace(/&(#?\w+);/g, (entity, name: string) => ENTITIES[name] ?? entity),
      }
    return {
      kind: 'shape',
      path: pathOf(kind!, number, values.get('d')),
      fill: values.get('fill') === 'none' ? null : tone('f-'),
      stroke: tone('s-'),
      strokeWidth: number('stroke-width', 1),
      opacity: number('opacity', 1),
      dash: (values.get('stroke-dasharray') ?? '').split(' ').filter(Boolean).map(Number),
      round: values.has('stroke-linejoin'),
    }
  })
}

function pathOf(kind: string, number: (name: string) => number, data = ''): string {
  if (kind === 'path') return data
  if (kind === 'circle') {
    const [x, y, r] = [number('cx'), number('cy'), number('r')]
    return `M${x - r} ${y}A${r} ${r} 0 1 1 ${x + r} ${y}A${r} ${r} 0 1 1 ${x - r} ${y}Z`
  }
  const [x, y, width, height] = [number('x'), number('y'), number('width'), number('height')]
  const r = Math.min(number('rx'), width / 2, height / 2)
  if (!r) return `M${x} ${y}h${width}v${height}h${-width}Z`
  const [across, down] = [width - 2 * r, height - 2 * r]
  const arc = (dx: number, dy: number) => `a${r} ${r} 0 0 1 ${dx} ${dy}`
  const upperRight = `h${across}${arc(r, r)}v${down}${arc(-r, r)}`
  return `M${x + r} ${y}${upperRight}h${-across}${arc(-r, -r)}v${-down}${arc(r, -r)}Z`
}
