/** The text of a parameter's value: `[1 2; 3 4]`, a robot by its name. */
export function valueText(value: unknown): string {
  if (Array.isArray(value)) {
    const rows = value as unknown[]
    if (rows.some((row) => Array.isArray(row)))
      return `[${rows.map((row) => (row as unknown[]).map(valueText).join(' ')).join('; ')}]`
    return `[${rows.map(valueText).join(' ')}]`
  }
  if (value && typeof value === 'object' && 'source' in value) {
    const { source, ...named } = value as { source: string } & Record<string, string>
    return source || Object.values(named).join()
  }
  if (typeof value === 'string') return value
  return value === null || value === undefined ? '' : JSON.stringify(value)
}
