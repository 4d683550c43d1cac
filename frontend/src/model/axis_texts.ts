/** Mean width of a letter of the labels of axes, px. */
const LETTER_WIDTH = 6
/** Minimum number of letters of a name that is cut off. */
const MIN_LETTERS = 3

/** The label of an axis, cut off before its unit if it is longer than `length`, px. */
export function fittedLabel(label: string, length: number): string {
  const letters = Math.floor(length / LETTER_WIDTH)
  if (label.length <= letters) return label
  const comma = label.lastIndexOf(', ')
  const unit = comma < 0 ? '' : label.slice(comma)
  const room = letters - unit.length - 1
  return room < MIN_LETTERS ? unit.slice(2) : `${label.slice(0, room).trimEnd()}…${unit}`
}

/** The text of a tick, with the digits that distinguish it from the next tick. */
export function tickText(value: number, step: number): string {
  if (Math.abs(value) < 1e6 && step >= 1e-6) {
    const places = (String(Number(step.toPrecision(3))).split('.')[1] ?? '').length
    return value.toFixed(places).replace('-', '−')
  }
  if (Math.abs(value) < step / 2) return '0'
  const digits = Math.ceil(Math.log10(Math.abs(value) / step)) + 2
  const [mantissa = '', exponent] = value.toExponential(Math.min(Math.max(digits - 1, 0), 15)).split('e')
  const short = mantissa.includes('.') ? mantissa.replace(/\.?0+$/, '') : mantissa
  return `${short}e${Number(exponent)}`.replaceAll('-', '−')
}
