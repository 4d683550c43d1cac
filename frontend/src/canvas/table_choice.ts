import type { TablePreview } from '../protocol'

/** A file of the project and its columns; for empty names, the server chooses the columns. */
export interface TableChoice {
  file: string
  time: string
  columns: string[]
}

/**
 * The choice with explicit column names, if another column of the file contains no numbers. Without names,
 * all columns would be read as values, and text would be an error.
 */
export function withColumnNames(choice: TableChoice, { columns, time, chosen }: TablePreview): TableChoice {
  const partial = !choice.columns.length && chosen.length > 0 && columns.some((column) => column.fault)
  return partial ? { ...choice, time, columns: chosen } : choice
}
