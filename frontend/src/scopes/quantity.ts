import { create } from 'zustand'
import { changed } from '../frames'

/** The display unit of a quantity: its number times `factor` has this unit. */
export interface Reading {
  factor: number
  unit: string
}

const PREFIXES: [power: number, prefix: string][] = [
  [12, 'T'],
  [9, 'G'],
  [6, 'M'],
  [3, 'k'],
  [0, ''],
  [-3, 'm'],
  [-6, 'µ'],
  [-9, 'n'],
  [-12, 'p'],
]

const spell = (unit: string) =>
  unit
    .replace(/\bdeg/, '°')
    .replaceAll('*', ' ')
    .replace(/\^?([23])\b/g, (_, power: string) => (power === '2' ? '²' : '³'))

/** Angles are shown in degrees by default, in radians on request. */
export const useUnits = create<{ radians: boolean }>(() => ({ radians: false }))
useUnits.subscribe(changed)

/**
 * Factor and unit in which magnitudes up to `largest` read well: degrees for angles, SI prefixes instead of
 * long zeros.
 */
export function reading(unit: string, largest: number, radians = useUnits.getState().radians): Reading {
  if (/^rad\b/.test(unit) && !radians) {
    return { factor: 180 / Math.PI, unit: spell(unit.replace(/^rad/, 'deg')) }
  }
  const spelled = spell(unit)
  // Prefixes go to plain units only: 1 kkg, 1 m m/s and 1 mrad would puzzle.
  if (!spelled || !(largest > 0) || !/^(m|N|s|A|V|W|J|N m|Hz|Pa|H|F)\b/.test(spelled))
    return { factor: 1, unit: spelled }
  const power = Math.floor(Math.log10(largest) / 3 + 1e-9) * 3
  const [exponent, prefix] = PREFIXES.find(([known]) => known <= power) ?? PREFIXES.at(-1)!
  return { factor: 10 ** -exponent, unit: prefix + spelled }
}

/** A number with so many significant digits, no exponent where people need none, and a true minus. */
export function digits(value: number, significant = 4): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? '–' : value > 0 ? '∞' : '−∞'
  if (value === 0) return '0'
  const size = Math.abs(value)
  const text =
    size >= 1e6 || size < 1e-4 ? value.toExponential(significant - 1) : value.toPrecision(significant)
  const plain = text.includes('e') && size < 1e6 && size >= 1e-4 ? String(Number(text)) : text
  return plain.replaceAll('-', '−')
}

/** A value with its unit, each as people read it: `1.234 mm`. */
export function spoken(value: number, unit: string, significant = 4): string {
  const { factor, unit: shown } = reading(unit, Math.abs(value))
  return `${digits(value * factor, significant)}${shown.startsWith('°') ? shown : shown && ` ${shown}`}`
}
