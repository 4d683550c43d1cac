import { expect, test } from 'vitest'
import { sharedDashes } from '../../src/model/shared_lines'

const time = Float64Array.from({ length: 50 }, (_, k) => k)
const wave = (phase: number) => time.map((t) => Math.sin(0.2 * t + phase))

/** Whether a dash pattern draws at a distance along the line. */
function draws(dash: number[], at: number): boolean {
  let rest = at % dash.reduce((sum, part) => sum + part, 0)
  return dash.findIndex((part) => (rest -= part) < 0) % 2 === 0
}

test('of coincident traces, exactly one is drawn at each position', () => {
  const dashes = sharedDashes([time, wave(0), wave(1), wave(0), wave(0).map((v) => v + 1e-9)], 2)
  expect(dashes[1]).toBeNull()
  const shared = dashes.filter((dash) => dash !== null)
  expect(shared).toHaveLength(3)
  for (let at = 0.5; at < 100; at++) expect(shared.filter((dash) => draws(dash, at))).toHaveLength(1)
})

test('different traces, and traces without values, have solid lines', () => {
  expect(sharedDashes([time, wave(0), wave(0.01)], 2)).toEqual([null, null])
  const empty = time.map(() => NaN)
  const none = Array.from(time, () => null)
  expect(sharedDashes([time, empty, empty.slice(), none, none.slice()], 2)).toEqual([null, null, null, null])
})
