import { expect, test } from 'vitest'
import { legendNames, legendRows, type LegendName } from '../../src/model/legend_names'
import { seeded } from './random'

const measure = (text: string) => Array.from(text).reduce((sum, letter) => sum + (letter === 'i' ? 3 : 6), 0)
const scalars = (...names: string[]): LegendName[] => names.map((name) => ({ name, entry: '' }))

test('a short name is whole beside a very long one, which is cut in the middle', () => {
  const names = scalars('position', 'torque of the second motor behind the gear', 'v')
  expect(legendNames(names, 150, measure)).toEqual(['position', 'torque o…the gear', 'v'])
  expect(legendNames(names, 400, measure)).toEqual(names.map(({ name }) => name))
})

test('names with equal ends are cut where they differ', () => {
  const names = scalars('controller left inner loop error', 'controller right inner loop error')
  const shown = legendNames(names, 200, measure)
  expect(new Set(shown).size).toBe(2)
  const inTheMiddle = scalars('torque of the motor before the gear', 'torque of the motor behind the gear')
  expect(legendNames(inTheMiddle, 120, measure)).toEqual(['…fore the…', '…hind the…'])
  const entries = ['q1', 'q2'].map((entry) => ({ name: 'measured angles of the arm', entry }))
  expect(legendNames(entries, 160, measure)).toEqual(['measu… arm q1', 'measu… arm q2'])
})

test('texts fit, and are whole or begin and end like the name, for random names', () => {
  const random = seeded(3)
  const letters = 'abciii_/ 1é𝜏'
  const alphabet = Array.from(letters)
  for (let round = 0; round < 300; round++) {
    const names = Array.from({ length: 1 + Math.floor(random() * 8) }, () => ({
      name: Array.from(
        { length: 1 + Math.floor(random() * 40) },
        () => alphabet[Math.floor(random() * alphabet.length)],
      ).join(''),
      entry: random() < 0.3 ? `q${Math.floor(random() * 9)}` : '',
    }))
    const room = 78 * names.length + random() * 500
    const shown = legendNames(names, room, measure)
    expect(shown.reduce((sum, text) => sum + measure(text), 0)).toBeLessThanOrEqual(room + 1e-9)
    const full = names.map(({ name, entry }) => (entry ? `${name} ${entry}` : name))
    const widest = Math.max(...shown.map(measure))
    shown.forEach((text, k) => {
      if (text === full[k]) return
      const [head = '', ...parts] = text.split('…')
      expect(full[k]!.startsWith(head) && full[k]!.endsWith(parts.at(-1)!)).toBe(true)
      expect(full[k]).toContain(parts[0])
      // Only names that are longer than the shown ones are cut.
      expect(measure(full[k]!)).toBeGreaterThan(Math.min(widest, measure(text)))
    })
  }
})

test('the legend of a picture has a row for names that do not fit beside the others', () => {
  const places = { first: 100, left: 50, right: 260, margin: 34 }
  const placed = legendRows(scalars('velocity', 'a long name of a signal', 'x'.repeat(60)), places, measure)
  expect(placed.map(({ x, row }) => [x, row])).toEqual([
    [100, 0],
    [50, 1],
    [50, 2],
  ])
  expect(placed.map(({ text }) => text.length)).toEqual([8, 23, 29])
})
