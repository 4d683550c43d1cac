import { Button, Group, Modal, Stack, Text } from '@mantine/core'
import { showDialog, useDialogs } from '../dialogs'
import { addTableBlock, replaceTable, useDroppedTable } from './dropped_table'

/** Asks whether a dropped table replaces a file of the same name. */
export function DroppedTableDialog() {
  const opened = useDialogs((s) => s.open === 'dropped_table')
  const waiting = useDroppedTable((s) => s.waiting)
  const close = () => showDialog(null)
  if (!waiting) return null
  const closeThen = (act: () => Promise<void>) => {
    close()
    void act()
  }
  return (
    <Modal opened={opened} onClose={close} title={<b>Replace {waiting.name}?</b>} size="md">
      <Stack gap="sm">
        <Text size="sm">
          The project folder contains another file with this name. Blocks that use this file would get the new
          values.
        </Text>
        <Group justify="flex-end" gap="xs">
          <Button variant="default" onClick={close} data-autofocus>
            Cancel
          </Button>
          <Button variant="default" onClick={() => closeThen(() => addTableBlock(waiting.name, waiting.at))}>
            Use the present file
          </Button>
          <Button color="red" onClick={() => closeThen(() => replaceTable(waiting))}>
            Replace
          </Button>
        </Group>
      </Stack>
    </Modal>
  )
}
