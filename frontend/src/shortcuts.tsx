import { Kbd, Modal, Table } from '@mantine/core'
import { create } from 'zustand'

const useShortcuts = create<{ opened: boolean }>(() => ({ opened: false }))

export function openShortcuts(): void {
  useShortcuts.setState({ opened: true })
}

const SHORTCUTS: [keys: string, what: string][] = [
  ['letters', 'add a block: type its name on the sheet'],
  ['>', 'draw a wire by the names of its ends'],
  ['Enter', 'open the block: its parameters, or the sheet inside'],
  ['Esc', 'out of the subsystem, or select nothing'],
  ['Tab', 'go from block to block'],
  ['arrows', 'move the selected blocks, with Shift by single pixels'],
  ['Del', 'delete blocks and wires'],
  ['Ctrl+G', 'group the selected blocks into a subsystem'],
  ['Ctrl+I', 'flip the selected blocks'],
  ['Ctrl+D', 'duplicate'],
  ['Ctrl+C, X, V', 'copy, cut, paste'],
  ['Ctrl+A', 'select all blocks'],
  ['Ctrl+Z, Ctrl+Y', 'undo, redo'],
  ['Ctrl+S', 'save; with Shift under another name'],
  ['Ctrl+O', 'open'],
  ['Ctrl+Enter', 'run, or go on after a pause'],
  ['Ctrl+E', 'configuration parameters: solver, tolerances, stop time'],
  ['Space', 'fit the sheet into the window'],
  ['?', 'this list'],
]

export function Shortcuts() {
  const { opened } = useShortcuts()
  return (
    <Modal opened={opened} onClose={() => useShortcuts.setState({ opened: false })} title="Keys" size="md">
      <Table>
        <Table.Tbody>
          {SHORTCUTS.map(([keys, what]) => (
            <Table.Tr key={keys}>
              <Table.Td>
                <Kbd>{keys}</Kbd>
              </Table.Td>
              <Table.Td>{what}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Modal>
  )
}
