const COLLATOR = new Intl.Collator('en', { numeric: true })

/** The elements in the order of a text in which numbers count as numbers: b39 before b1039. */
export function inNaturalOrder<T>(elements: readonly T[], text: (element: T) => string): T[] {
  return [...elements].sort((one, other) => COLLATOR.compare(text(one), text(other)))
}
