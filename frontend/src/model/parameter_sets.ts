import type { ParameterSetTable } from '../protocol'

type Values = Readonly<Record<string, unknown>>

const equal = (a: unknown, b: unknown) => JSON.stringify(a) === JSON.stringify(b)

/** Whether two collections contain the same parameters with the same values. */
export function sameValues(one: Values, other: Values): boolean {
  const paths = Object.keys(one)
  return paths.length === Object.keys(other).length && paths.every((path) => equal(one[path], other[path]))
}

/** The set whose values are exactly the tried values. */
export function activeSet(table: ParameterSetTable, trialValues: Values): string | undefined {
  if (!Object.keys(trialValues).length) return undefined
  return Object.keys(table.sets).find((name) => sameValues(table.sets[name]!, trialValues))
}

/** The names of the sets in alphabetical order, in which digits are compared as numbers. */
export function setNames(table: ParameterSetTable): string[] {
  return Object.keys(table.sets).toSorted((a, b) => a.localeCompare(b, undefined, { numeric: true }))
}

/** One cell of the table of sets: the value, and whether the model has this value. */
export interface Cell {
  value: unknown
  /** The set does not contain the parameter: applying it leaves the value of the model. */
  inherited: boolean
  differs: boolean
  fault: string
}

/** The values of the sets for one parameter. */
export interface Row {
  path: string
  unit: string
  doc: string
  model: unknown
  tunable: boolean
  cells: Cell[]
  /** Whether the sets would give the parameter different values. */
  varies: boolean
}

/** The table of sets: a row for each parameter, a cell for each of the given sets. */
export function setRows(table: ParameterSetTable, names: string[]): Row[] {
  return table.parameters.map(({ path, unit, doc, value: model, tunable }) => {
    const cells = names.map((name): Cell => {
      const values = table.sets[name] ?? {}
      const inherited = !(path in values)
      const value = inherited ? model : values[path]
      return { value, inherited, differs: !equal(value, model), fault: table.faults[name]?.[path] ?? '' }
    })
    const varies = cells.some(({ value }) => !equal(value, cells[0]?.value))
    return { path, unit, doc, model, tunable, cells, varies }
  })
}

/** The first reason why a set cannot be applied to the model or, with `asTrial`, tried. */
export function refusalReason(table: ParameterSetTable, name: string, asTrial: boolean): string | undefined {
  const fault = Object.entries(table.faults[name] ?? {})[0]
  if (fault) return `${fault[0]}: ${fault[1]}`
  const values = table.sets[name] ?? {}
  if (!Object.keys(values).length) return 'The set has no values.'
  const fixed = table.parameters.find(({ path, tunable }) => path in values && !tunable)
  if (asTrial && fixed) return `${fixed.path} cannot change without compiling: put the set into the model.`
  return undefined
}

/**
 * The parameter changes of a run in progress that replace the tried values `before` by `next`. Parameters
 * that are no longer tried return to the values of the model.
 */
export function changedTrials(
  before: Values,
  next: Values,
  modelValue: (path: string) => unknown,
): Record<string, unknown> {
  const changed: Record<string, unknown> = {}
  for (const path of Object.keys(before)) {
    const value = path in next ? undefined : modelValue(path)
    if (value !== undefined) changed[path] = value
  }
  for (const [path, value] of Object.entries(next))
    if (!(path in before) || !equal(before[path], value)) changed[path] = value
  return changed
}
