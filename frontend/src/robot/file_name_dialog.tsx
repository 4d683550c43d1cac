import { Button, Group, Modal, Stack, Text, TextInput } from '@mantine/core'

interface FileNameDialogProps {
  opened: boolean
  title: string
  description: string
  path: string
  /** A remark on the name, or empty. */
  note?: string
  /** Why the file was not written; empty if it was not tried. */
  refusal: string
  onPath: (path: string) => void
  onSave: (overwrite: boolean) => void
  onClose: () => void
}

/** Asks for the name under which a file is saved, and whether an existing file is overwritten. */
export function FileNameDialog(props: FileNameDialogProps) {
  const { opened, title, description, path, note = '', refusal, onPath, onSave, onClose } = props
  return (
    <Modal opened={opened} onClose={onClose} title={<b>{title}</b>} size="sm">
      <form
        onSubmit={(event) => {
          event.preventDefault()
          onSave(false)
        }}
      >
        <Stack gap="sm">
          <TextInput
            label="File in this folder"
            description={description}
            data-autofocus
            value={path}
            error={refusal || undefined}
            onChange={(event) => onPath(event.currentTarget.value)}
          />
          {note && !refusal && (
            <Text size="xs" c="dimmed">
              {note}
            </Text>
          )}
          <Group justify="flex-end" gap="xs">
            <Button variant="default" onClick={onClose}>
              Cancel
            </Button>
            {refusal && (
              <Button color="red" variant="light" onClick={() => onSave(true)}>
                Overwrite
              </Button>
            )}
            <Button type="submit" disabled={!path.trim()}>
              Save
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  )
}
