import { expect, test } from 'vitest'
import { faceMarks } from '../../src/model/face_marks'

test('the marks of a face have the colours, lines and texts of the SVG', () => {
  const face =
    '<rect x="0" y="0" width="68" height="50" rx="5" class="f-surface s-wire" stroke-width="1.2"/>' +
    '<path d="M9 8L9 42" class="s-hairline" fill="none" stroke-dasharray="3 2"/>' +
    '<g><title>t</title><circle cx="5" cy="6" r="2" class="f-trace-0" opacity="0.5"/></g>' +
    '<text x="34" y="20" font-size="13" class="f-ink m" text-anchor="middle" font-weight="600">' +
    'a &lt; b &amp; c</text>' +
    '<image x="0" y="0" width="1" height="1" href="data:,"/>'
  const [card, line, disc, text, ...others] = faceMarks(face)
  expect(others).toEqual([])
  expect(card).toMatchObject({ fill: 'surface', stroke: 'wire', strokeWidth: 1.2, opacity: 1, round: false })
  expect(card).toMatchObject({
    path: 'M5 0h58a5 5 0 0 1 5 5v40a5 5 0 0 1 -5 5h-58a5 5 0 0 1 -5 -5v-40a5 5 0 0 1 5 -5Z',
  })
  expect(line).toMatchObject({
    path: 'M9 8L9 42',
    fill: null,
    stroke: 'hairline',
    dash: [3, 2],
    strokeWidth: 1,
  })
  expect(disc).toMatchObject({ path: 'M3 6A2 2 0 1 1 7 6A2 2 0 1 1 3 6Z', fill: 'trace-0', opacity: 0.5 })
  expect(text).toEqual({
    kind: 'text',
    x: 34,
    y: 20,
    size: 13,
    fill: 'ink',
    anchor: 'middle',
    mono: true,
    bold: true,
    italic: false,
    upright: false,
    text: 'a < b & c',
  })
})
