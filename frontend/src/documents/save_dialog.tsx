import { Alert, Autocomplete, Button, Group, Modal, Stack, Text } from '@mantine/core'
import { useEffect, useState } from 'react'
import { Refusal } from '../connection'
import { SCROLLED } from '../searchable_lists'
import { connection, useStudio } from '../store'
import { projectFiles, showDialog, useDialogs } from '../dialogs'

const withSuffix = (typed: string) => (/\.json$/i.test(typed.trim()) ? typed.trim() : `${typed.trim()}.json`)

/** Save as: a name in the project folder; an existing file is overwritten only on request. */
export function SaveDialog() {
  const opened = useDialogs((s) => s.open === 'save_as')
  const openCount = useDialogs((s) => s.openCount)
  return (
    <Modal opened={opened} onClose={() => showDialog(null)} title={<b>Save as</b>} size="md">
      <SaveAs key={openCount} />
    </Modal>
  )
}

function SaveAs() {
  const document = useStudio((s) => s.document)
  const [typed, setTyped] = useState(document?.state.path ?? `${document?.state.title ?? 'untitled'}.json`)
  const [files, setFiles] = useState<string[]>([])
  const [fault, setFault] = useState<Refusal | null>(null)
  useEffect(
    () =>
      void projectFiles().then((listing) => setFiles(listing.files.filter((file) => file.endsWith('.json')))),
    [],
  )
  if (!document) return null
  const path = withSuffix(typed)
  const exists = files.includes(path) && path !== document.state.path

  const save = async () => {
    try {
      await connection.ask({ kind: 'save', document: document.state.document, path, overwrite: exists })
      showDialog(null)
    } catch (error) {
      if (!(error instanceof Refusal)) throw error
      setFault(error)
      setFiles((await projectFiles()).files)
    }
  }

  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        void save()
      }}
    >
      <Stack gap="sm">
        <Autocomplete
          label="File"
          description="A name in the project folder; missing folders are created: models/arm.json"
          data-autofocus
          data={files.filter((file) => file !== path)}
          limit={8}
          {...SCROLLED}
          comboboxProps={{ withinPortal: true }}
          value={typed}
          onChange={(value) => {
            setTyped(value)
            setFault(null)
          }}
          error={fault && !exists ? fault.what : undefined}
        />
        {fault && !exists && (
          <Text size="xs" c="dimmed">
            {fault.fix}
          </Text>
        )}
        {exists && (
          <Alert color="yellow" title={`${path} already exists`}>
            Its content will be replaced by this diagram.
          </Alert>
        )}
        <Group justify="flex-end" gap="xs">
          <Button variant="default" onClick={() => showDialog(null)}>
            Cancel
          </Button>
          <Button type="submit" color={exists ? 'red' : undefined} disabled={!typed.trim()}>
            {exists ? 'Overwrite' : 'Save'}
          </Button>
        </Group>
      </Stack>
    </form>
  )
}
