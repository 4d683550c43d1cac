const COLLATOR = new Intl.Collator('en', { numeric: true })

/** Sort the elements by a text in which digits are compared as numbers: b39 before b1039. */
export function inNaturalOrder<T>(elements: readonly T[], text: (element: T) => string): T[] {
  return [...elements].sort((one, other) => COLLATOR.compare(text(one), text(other)))
}
