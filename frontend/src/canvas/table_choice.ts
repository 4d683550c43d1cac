import type { TablePreview } from '../protocol'

/** A file of the project and its columns; empty names are chosen by the file. */
export interface TableChoice {
  file: string
  time: string
  columns: string[]
}

/**
 * The choice with the names of its columns, if the file has others that contain no numbers: without names,
 * all columns of the file would be values, and text an error.
 */
export function withColumnNames(choice: TableChoice, { columns, time, chosen }: TablePreview): TableChoice {
  const partial = !choice.columns.length && chosen.length > 0 && columns.some((column) => column.fault)
  return partial ? { ...choice, time, columns: chosen } : choice
}
