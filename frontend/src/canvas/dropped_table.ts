import { create } from 'zustand'
import { showDialog } from '../dialogs'
import { ask, refuse, useStudio } from '../store'
import { withColumnNames } from './table_choice'
import { insertBlock, sheetPointAt } from './insert'

/** A dropped table whose file name is in use: the user decides whether to replace the file. */
export interface DroppedTable {
  name: string
  content: string
  at: { x: number; y: number }
}

export const useDroppedTable = create<{ waiting: DroppedTable | null }>(() => ({ waiting: null }))

/** Store a dropped table in the project folder and add a block with it, unless another file has its name. */
export async function dropTable(name: string, content: string, position: DroppedTable['at']): Promise<void> {
  if (!useStudio.getState().document) {
    refuse({ what: 'no diagram is open', where: name, fix: 'open a diagram, and drop the file on its sheet' })
    return
  }
  const stored = await ask({ kind: 'store_file', name, content })
  if (!stored) return
  if (stored.stored) return addTableBlock(stored.path, position)
  useDroppedTable.setState({ waiting: { name, content, at: position } })
  showDialog('dropped_table')
}

/** Replace the file of the same name, and add a block with the table. */
export async function replaceTable({ name, content, at: position }: DroppedTable): Promise<void> {
  const stored = await ask({ kind: 'store_file', name, content, replace: true })
  if (stored) await addTableBlock(stored.path, position)
}

/** Add a block whose parameter is the table of a file, and open its dialog for the choice of columns. */
export async function addTableBlock(file: string, position: DroppedTable['at']): Promise<void> {
  for (const blockType of useStudio.getState().library.values()) {
    const rule = blockType.parameters.find((parameter) => parameter.kind === 'table')
    if (!rule) continue
    const stem = file.replace(/^.*\//, '').replace(/\.[^.]*$/, '')
    const choice = { file, time: '', columns: [] }
    const preview = await ask({ kind: 'preview_table', ...choice })
    const parameters = { [rule.name]: preview ? withColumnNames(choice, preview) : choice }
    const name = await insertBlock(blockType.type, sheetPointAt(position), { parameters, name: stem })
    if (name !== undefined) useStudio.getState().edit(name)
    return
  }
}
