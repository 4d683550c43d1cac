import { expect, test } from 'vitest'
import { outstandingMoves, withMoves, type SentMove } from '../../src/model/sent_moves'
import type { SheetBlock } from '../../src/protocol'

const block = (x: number) => ({ name: 'a', place: { x, y: 0 } }) as SheetBlock
const sheet = (version: number, x: number) => ({
  state: { document: 'd', version },
  inside: [],
  blocks: { a: block(x) },
  notes: { '/1': { x, y: 0, text: 'n' } },
})
const move = (key: number, x: number, version: number | null = null): SentMove => ({
  key: String(key),
  document: 'd',
  inside: '',
  version,
  places: { a: { x, y: 0 } },
  notes: {},
})

test('ten quick moves are shown immediately; the tenth position remains for any order of the replies', () => {
  const moves = Array.from({ length: 10 }, (_, k) => move(k, 5 * (k + 1)))
  for (const repliesFirst of [true, false]) {
    let sent = moves
    expect(withMoves(sheet(1, 0), sent).blocks.a.place.x).toBe(50)
    for (let k = 0; k < 10; k++) {
      const version = k + 2
      if (repliesFirst) sent = sent.map((one) => (one.key === String(k) ? { ...one, version } : one))
      const state = sheet(version, 5 * (k + 1))
      sent = outstandingMoves(sent, state)
      expect(withMoves(state, sent).blocks.a.place.x, `after the change ${k}`).toBe(50)
    }
    expect(sent).toEqual([])
  }
})

test('moves of other sheets and documents, and of removed blocks, do not change the sheet', () => {
  const state = sheet(3, 0)
  const elsewhere = [
    { ...move(1, 9), inside: 'b' },
    { ...move(2, 9), document: 'e' },
  ]
  expect(withMoves(state, elsewhere)).toBe(state)
  expect(outstandingMoves(elsewhere, state)).toEqual(elsewhere)
  const removed = { ...move(3, 9), places: { removed: { x: 1, y: 1 } } }
  expect(withMoves(state, [removed]).blocks).toEqual(state.blocks)
})

test('a note moves with the blocks', () => {
  const noted = { ...move(1, 5), notes: { '/1': { x: 7, y: 8, text: 'n' } } }
  expect(withMoves(sheet(1, 0), [noted]).notes['/1']).toEqual({ x: 7, y: 8, text: 'n' })
})
