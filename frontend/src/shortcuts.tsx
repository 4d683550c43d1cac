import { Kbd, Modal, Table } from '@mantine/core'
import { commands } from './commands'
import { show, useDialogs } from './dialogs'

/** What is no command: how one moves about. */
const HABITS: [keys: string, what: string][] = [
  ['letters', 'Add a block: type its name on the sheet'],
  ['Enter', 'Open the block: its parameters, or the sheet inside; edit the note'],
  ['Tab', 'Go from block to block'],
  ['arrows', 'Move what is selected, with Shift by single pixels'],
  ['Del', 'Delete blocks, wires and notes'],
  ['Ctrl+K', 'All commands by name'],
]

export function Shortcuts() {
  const opened = useDialogs((s) => s.open === 'keys')
  return (
    <Modal opened={opened} onClose={() => show(null)} title="Keys" size="md">
      <Table>
        <Table.Tbody>
          {[...HABITS, ...commands().flatMap(({ keys, title }): [string, string][] => (keys ? [[keys, title]] : []))].map(([keys, what]) => (
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
