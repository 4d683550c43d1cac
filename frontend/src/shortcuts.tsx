import { Kbd, Modal, Table } from '@mantine/core'
import { Fragment } from 'react'
import { commands } from './commands'
import { show, useDialogs } from './dialogs'
import { KEYS } from './key_list'

/** The list of all keys, by the place where they are handled. */
export function Shortcuts() {
  const opened = useDialogs((s) => s.open === 'keys')
  const called = commands().flatMap(({ keys, title }): [string, string][] => (keys ? [[keys, title]] : []))
  return (
    <Modal opened={opened} onClose={() => show(null)} title={<b>Keys</b>} size="lg">
      <Table className="keys" aria-label="Keys">
        {[{ place: 'Commands', keys: called }, ...KEYS].map(({ place, keys }) => (
          <Fragment key={place}>
            <Table.Thead>
              <Table.Tr>
                <Table.Th colSpan={2} scope="rowgroup">
                  {place}
                </Table.Th>
              </Table.Tr>
            </Table.Thead>
            <Table.Tbody>
              {keys.map(([ways, what]) => (
                <Table.Tr key={ways}>
                  <Table.Td className="ways">
                    {ways.split(', ').map((way) => (
                      <Kbd key={way}>{way}</Kbd>
                    ))}
                  </Table.Td>
                  <Table.Td>{what}</Table.Td>
                </Table.Tr>
              ))}
            </Table.Tbody>
          </Fragment>
        ))}
      </Table>
    </Modal>
  )
}
