import { create } from 'zustand'
import { scheduleFrame } from '../frames'

/** The display unit of a quantity, and the factor from SI to this unit. */
export interface DisplayUnit {
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

const unitSymbols = (unit: string) =>
  unit
    .replace(/\bdeg/, '°')
    .replaceAll('*', ' ')
    .replace(/\^?([23])\b/g, (_, power: string) => (power === '2' ? '²' : '³'))

/** Angles are shown in degrees by default, in radians on request. */
export const useUnits = create<{ radians: boolean }>(() => ({ radians: false }))
useUnits.subscribe(scheduleFrame)

/**
 * Factor and unit for magnitudes up to `largest`: degrees for angles, SI prefixes to avoid many zeros.
 */
export function displayUnit(
  unit: string,
  largest: number,
  radians = useUnits.getState().radians,
): DisplayUnit {
  if (/^rad\b/.test(unit) && !radians) {
    return { factor: 180 / Math.PI, unit: unitSymbols(unit.replace(/^rad/, 'deg')) }
  }
  const symbols = unitSymbols(unit)
  // Only plain units have prefixes, which excludes 1 kkg, 1 m m/s and 1 mrad.
  if (!symbols || !(largest > 0) || !/^(m|N|s|A|V|W|J|N m|Hz|Pa|H|F)\b/.test(symbols))
    return { factor: 1, unit: symbols }
  const power = Math.floor(Math.log10(largest) / 3 + 1e-9) * 3
  const [exponent, prefix] = PREFIXES.find(([exponent]) => exponent <= power) ?? PREFIXES.at(-1)!
  return { factor: 10 ** -exponent, unit: prefix + symbols }
}

/** A number with `significant` digits, without exponent if possible, and with a typographic minus sign. */
export function formatNumber(value: number, significant = 4): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? '–' : value > 0 ? '∞' : '−∞'
  if (value === 0) return '0'
  const magnitude = Math.abs(value)
  const text =
    magnitude >= 1e6 || magnitude < 1e-4
      ? value.toExponential(significant - 1)
      : value.toPrecision(significant)
  const fixedText = text.includes('e') && magnitude < 1e6 && magnitude >= 1e-4 ? String(Number(text)) : text
  return fixedText.replaceAll('-', '−')
}

/** A value with its display unit: `1.234 mm`. */
export function withUnit(value: number, unit: string, significant = 4): string {
  const { factor, unit: shown } = displayUnit(unit, Math.abs(value))
  return `${formatNumber(value * factor, significant)}${shown.startsWith('°') ? shown : shown && ` ${shown}`}`
}
