import { fittedLabel, tickText } from '../model/axis_texts'
import { legendRows } from '../model/legend_names'

export interface Axis {
  min: number
  max: number
  label: string
}

/** A plot as data, which is painted on a canvas or written as SVG with the same appearance. */
export interface Figure {
  title: string
  width: number
  height: number
  x: Axis
  y: Axis
  /** Whether both axes have the same scale. */
  equal?: boolean
  lines: {
    tone: string
    dash: number[]
    label: string
    x: ArrayLike<number>
    y: ArrayLike<number | null | undefined>
  }[]
  /** The present position on a path. */
  mark?: [x: number, y: number] | undefined
}

interface Painter {
  line: (points: [number, number][], tone: string, width: number, dash: number[]) => void
  text: (
    x: number,
    y: number,
    text: string,
    tone: string,
    anchor: 'start' | 'middle' | 'end',
    bold?: boolean,
    vertical?: boolean,
  ) => void
  disc: (x: number, y: number, radius: number, tone: string) => void
  inside: (box: Box, paint: () => void) => void
}

interface Box {
  left: number
  top: number
  width: number
  height: number
}

/** Font size, px. */
const FONT_SIZE = 11

/** Round values in a range: about `maxCount`, and at least two. */
export function ticks(min: number, max: number, maxCount: number): number[] {
  const minStep = (max - min) / Math.max(maxCount, 1)
  const magnitude = 10 ** Math.floor(Math.log10(minStep))
  const steps = [0.5, 1, 2, 2.5, 5, 10].map((k) => k * magnitude)
  const preferred = steps.findIndex((step, k) => k > 0 && step >= minStep * (1 - 1e-9))
  const multiples = (step: number) => {
    const values: number[] = []
    // The sum with 0 is never −0.
    for (let k = Math.ceil(min / step - 1e-9); k * step <= max + 1e-9 * step; k++) values.push(k * step + 0)
    return values
  }
  // One value gives no scale.
  for (let k = preferred; k > 0; k--) {
    const values = multiples(steps[k]!)
    if (values.length > 1) return values
  }
  return multiples(steps[0]!)
}

/** Left edge of the plot, px. */
const LEFT = 58

function draw(figure: Figure, painter: Painter): void {
  const { title, width, height, x, y } = figure
  const legend = legendOf(figure, LEFT)
  const top = legend.length || title ? 30 + LEGEND_ROW * (legend.at(-1)?.row ?? 0) : 10
  const box: Box = { left: LEFT, top, width: width - LEFT - 12, height: Math.max(height - top - 40, 40) }
  let [x0, x1, y0, y1] = [x.min, x.max, y.min, y.max]
  if (figure.equal) {
    const scale = Math.max((x1 - x0) / box.width, (y1 - y0) / box.height)
    const [extraX, extraY] = [(scale * box.width - (x1 - x0)) / 2, (scale * box.height - (y1 - y0)) / 2]
    ;[x0, x1, y0, y1] = [x0 - extraX, x1 + extraX, y0 - extraY, y1 + extraY]
  }
  const atX = (value: number) => box.left + ((value - x0) / (x1 - x0)) * box.width
  const atY = (value: number) => box.top + box.height - ((value - y0) / (y1 - y0)) * box.height
  const xTicks = ticks(x0, x1, Math.max(2, Math.floor(box.width / 80)))
  const yTicks = ticks(y0, y1, Math.max(2, Math.floor(box.height / 36)))
  const bottom = box.top + box.height
  for (const value of xTicks) {
    painter.line(
      [
        [atX(value), box.top],
        [atX(value), bottom],
      ],
      'grid',
      1,
      [],
    )
    painter.text(atX(value), bottom + 15, tickText(value, xTicks[1]! - xTicks[0]! || 1), 'muted', 'middle')
  }
  for (const value of yTicks) {
    painter.line(
      [
        [box.left, atY(value)],
        [box.left + box.width, atY(value)],
      ],
      'grid',
      1,
      [],
    )
    painter.text(box.left - 6, atY(value) + 4, tickText(value, yTicks[1]! - yTicks[0]! || 1), 'muted', 'end')
  }
  painter.text(box.left + box.width / 2, bottom + 32, fittedLabel(x.label, box.width), 'muted', 'middle')
  const yLabel = fittedLabel(y.label, box.height)
  if (yLabel) painter.text(13, box.top + box.height / 2, yLabel, 'muted', 'middle', false, true)
  painter.inside(box, () => {
    for (const line of figure.lines) {
      const points: [number, number][] = []
      for (let k = 0; k < line.x.length; k++) {
        const value = line.y[k]
        if (typeof value === 'number' && Number.isFinite(value)) points.push([atX(line.x[k]!), atY(value)])
      }
      painter.line(points, line.tone, 1.5, line.dash)
    }
    if (figure.mark) painter.disc(atX(figure.mark[0]), atY(figure.mark[1]), 4.5, 'accent')
  })
  if (title) painter.text(box.left, LEGEND_Y, title, 'ink', 'start', true)
  for (const { text, x: left, row, tone, dash } of legend) {
    const baseline = LEGEND_Y + LEGEND_ROW * row
    painter.line(
      [
        [left, baseline - 4],
        [left + 16, baseline - 4],
      ],
      tone,
      2.5,
      dash,
    )
    painter.text(left + 21, baseline, text, 'muted', 'start')
  }
}

/** Baseline of the first row of the legend, and distance of its rows, px. */
const LEGEND_Y = 17
const LEGEND_ROW = 16

/** The entries of the legend, beside the title and in as many further rows as they need. */
function legendOf({ title, lines, width }: Figure, left: number) {
  if (lines.length < 2) return []
  const names = lines.map(({ label }) => ({ name: label, entry: '' }))
  const places = { first: left + 8 * title.length + (title ? 18 : 0), left, right: width, margin: 34 }
  return legendRows(names, places, (text) => 6.4 * text.length).map((entry, k) => ({
    ...entry,
    tone: lines[k]!.tone,
    dash: lines[k]!.dash,
  }))
}

const colour = (tone: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${tone}`).trim()
const fontOf = () => colour('font') || 'sans-serif'

/** Paint a figure on a canvas whose size, in device pixels, the caller has set. */
export function paint(figure: Figure, canvas: HTMLCanvasElement, scale: number): void {
  const context = canvas.getContext('2d')
  if (!context) return
  context.setTransform(scale, 0, 0, scale, 0, 0)
  context.fillStyle = colour('surface')
  context.fillRect(0, 0, figure.width, figure.height)
  draw(figure, {
    line: (points, tone, width, dash) => {
      context.beginPath()
      points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)))
      context.strokeStyle = colour(tone)
      context.lineWidth = width
      context.lineJoin = 'round'
      context.setLineDash(dash)
      context.stroke()
    },
    text: (x, y, text, tone, anchor, bold, vertical) => {
      context.save()
      context.translate(x, y)
      if (vertical) context.rotate(-Math.PI / 2)
      context.font = `${bold ? '600 ' : ''}${bold ? FONT_SIZE + 1 : FONT_SIZE}px ${fontOf()}`
      context.fillStyle = colour(tone)
      context.textAlign = anchor === 'middle' ? 'center' : anchor
      context.fillText(text, 0, 0)
      context.restore()
    },
    disc: (x, y, radius, tone) => {
      context.beginPath()
      context.arc(x, y, radius, 0, 2 * Math.PI)
      context.fillStyle = colour(tone)
      context.fill()
    },
    inside: (box, content) => {
      context.save()
      context.beginPath()
      context.rect(box.left, box.top, box.width, box.height)
      context.clip()
      content()
      context.restore()
    },
  })
}

const escaped = (text: string) => text.replace(/[&<>"]/g, (mark) => `&#${mark.charCodeAt(0)};`)

/** The figure as an SVG document, in the present theme. */
export function svgOf(figure: Figure): string {
  const parts: string[] = []
  draw(figure, {
    line: (points, tone, width, dash) => {
      const d = points.map(([x, y], k) => `${k ? 'L' : 'M'}${x.toFixed(2)} ${y.toFixed(2)}`).join('')
      const dashed = dash.length ? ` stroke-dasharray="${dash.join(' ')}"` : ''
      if (points.length)
        parts.push(
          `<path d="${d}" fill="none" stroke="${colour(tone)}" stroke-width="${width}" ` +
            `stroke-linejoin="round"${dashed}/>`,
        )
    },
    text: (x, y, text, tone, anchor, bold, vertical) => {
      const weight = bold ? ' font-weight="600"' : ''
      const rotation = vertical ? ` transform="rotate(-90 ${x.toFixed(1)} ${y.toFixed(1)})"` : ''
      parts.push(
        `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" fill="${colour(tone)}" text-anchor="${anchor}" ` +
          `font-size="${bold ? FONT_SIZE + 1 : FONT_SIZE}"${weight}${rotation}>${escaped(text)}</text>`,
      )
    },
    disc: (x, y, radius, tone) =>
      parts.push(`<circle cx="${x.toFixed(2)}" cy="${y.toFixed(2)}" r="${radius}" fill="${colour(tone)}"/>`),
    inside: ({ left, top, width, height }, content) => {
      parts.push(
        `<clipPath id="field"><rect x="${left}" y="${top}" width="${width}" height="${height}"/></clipPath>` +
          '<g clip-path="url(#field)">',
      )
      content()
      parts.push('</g>')
    },
  })
  const { width, height } = figure
  return (
    `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" ` +
    `viewBox="0 0 ${width} ${height}" font-family="${escaped(fontOf())}">` +
    `<rect width="100%" height="100%" fill="${colour('surface')}"/>${parts.join('')}</svg>\n`
  )
}
