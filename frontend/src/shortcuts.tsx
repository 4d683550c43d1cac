import { Kbd, Modal, Table } from '@mantine/core'
import { Fragment } from 'react'
import { commands } from './commands'
import { showDialog, useDialogs } from './dialogs'
import { KEYS } from './key_list'

/** The list of all keys, by the place where they are handled. */
export function Shortcuts() {
  const opened = useDialogs((s) => s.open === 'keys')
  const commandKeys = commands().flatMap(({ keys, title }): [string, string][] =>
    keys ? [[keys, title]] : [],
  )
  return (
    <Modal opened={opened} onClose={() => showDialog(null)} title={<b>Keys</b>} size="lg">
      <Table className="keys" aria-label="Keys">
        {[{ title: 'Commands', keys: commandKeys }, ...KEYS].map(({ title, keys }) => (
          <Fragment key={title}>
            <Table.Thead>
              <Table.Tr>
                <Table.Th colSpan={2} scope="rowgroup">
                  {title}
                </Table.Th>
              </Table.Tr>
            </Table.Thead>
            <Table.Tbody>
              {keys.map(([combinations, effect]) => (
                <Table.Tr key={combinations}>
                  <Table.Td className="ways">
                    {combinations.split(', ').map((combination) => (
                      <Kbd key={combination}>{combination}</Kbd>
                    ))}
                  </Table.Td>
                  <Table.Td>{effect}</Table.Td>
                </Table.Tr>
              ))}
            </Table.Tbody>
          </Fragment>
        ))}
      </Table>
    </Modal>
  )
}
