import { create } from 'zustand'
import { changed } from '../frames'

/** The display unit of a quantity, and the factor from SI to this unit. */
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
 * Factor and unit for magnitudes up to `largest`: degrees for angles, SI prefixes to avoid long zeros.
 */
export function reading(unit: string, largest: number, radians = useUnits.getState().radians): Reading {
  if (/^rad\b/.test(unit) && !radians) {
    return { factor: 180 / Math.PI, unit: spell(unit.replace(/^rad/, 'deg')) }
  }
  const spelled = spell(unit)
  // Only plain units have prefixes, which excludes 1 kkg, 1 m m/s and 1 mrad.
  if (!spelled || !(largest > 0) || !/^(m|N|s|A|V|W|J|N m|Hz|Pa|H|F)\b/.test(spelled))
    return { factor: 1, unit: spelled }
  const power = Math.floor(Math.log10(largest) / 3 + 1e-9) * 3
  const [exponent, prefix] = PREFIXES.find(([known]) => known <= power) ?? PREFIXES.at(-1)!
  return { factor: 10 ** -exponent, unit: prefix + spelled }
}

/** A number with so many significant digits, without exponent if possible, and with a true minus sign. */
export function digits(value: number, significant = 4): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? '–' : value > 0 ? '∞' : '−∞'
  if (value === 0) return '0'
  const size = Math.abs(value)
  const text =
    size >= 1e6 || size < 1e-4 ? value.toExponential(significant - 1) : value.toPrecision(significant)
  const plain = text.includes('e') && size < 1e6 && size >= 1e-4 ? String(Number(text)) : text
  return plain.replaceAll('-', '−')
}

/** A value with its display unit: `1.234 mm`. */
export function spoken(value: number, unit: string, significant = 4): string {
  const { factor, unit: shown } = reading(unit, Math.abs(value))
  return `${digits(value * factor, significant)}${shown.startsWith('°') ? shown : shown && ` ${shown}`}`
}
