import { paint, svgOf, type Figure } from './figure'
import { firstAfter, firstNotBefore } from '../model/time_index'
import type { Trace } from '../model/trace'

const PNG_SCALE = 2

/** Start the download of a file. */
export function download(name: string, content: Blob): void {
  const link = document.createElement('a')
  link.href = URL.createObjectURL(content)
  link.download = name.replace(/[^\p{L}\p{N} ._-]+/gu, '-')
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000)
}

export function saveSvg(figure: Figure): void {
  download(`${figure.title || 'plot'}.svg`, new Blob([svgOf(figure)], { type: 'image/svg+xml' }))
}

export async function savePng(figure: Figure): Promise<void> {
  const canvas = document.createElement('canvas')
  canvas.width = PNG_SCALE * figure.width
  canvas.height = PNG_SCALE * figure.height
  paint(figure, canvas, PNG_SCALE)
  const blob = await new Promise<Blob | null>((done) => canvas.toBlob(done, 'image/png'))
  if (blob) download(`${figure.title || 'plot'}.png`, blob)
}

const quoted = (text: string) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)

/**
 * The recorded samples of the traces in a range of times, in SI units. Traces of another run have a separate
 * time column.
 */
export function csvOf(traces: Trace[], range: [number, number] = [-Infinity, Infinity]): string {
  const columns: { name: string; values: Float64Array }[] = []
  let previousTime: Float64Array | undefined
  for (const { label, unit, read } of traces) {
    const samples = read()
    if (!samples) continue
    const [begin, end] = [firstNotBefore(samples.time, range[0]), firstAfter(samples.time, range[1])]
    if (
      !previousTime ||
      previousTime.length !== samples.time.length ||
      previousTime.buffer !== samples.time.buffer
    )
      columns.push({ name: 'time [s]', values: samples.time.subarray(begin, end) })
    previousTime = samples.time
    columns.push({ name: unit ? `${label} [${unit}]` : label, values: samples.values.subarray(begin, end) })
  }
  const rows = Math.max(0, ...columns.map(({ values }) => values.length))
  const lines = [columns.map(({ name }) => quoted(name)).join(',')]
  for (let row = 0; row < rows; row++)
    lines.push(columns.map(({ values }) => (row < values.length ? String(values[row]) : '')).join(','))
  return `${lines.join('\n')}\n`
}

export function saveCsv(name: string, traces: Trace[], range?: [number, number]): void {
  download(`${name || 'plot'}.csv`, new Blob([csvOf(traces, range)], { type: 'text/csv' }))
}
