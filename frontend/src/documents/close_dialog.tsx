import { Alert, Button, Group, Modal, Stack, Text, TextInput } from '@mantine/core'
import { useState } from 'react'
import { Refusal } from '../connection'
import { projectFiles, showDialog, useDialogs } from '../dialogs'
import type { DocumentState } from '../protocol'
import { connection, useStudio } from '../store'
import { closeDocument, useTabs } from './tabs'

/** Asks whether the unsaved changes of a document are saved or discarded before it is closed. */
export function CloseDialog() {
  const opened = useDialogs((s) => s.open === 'close')
  const openCount = useDialogs((s) => s.openCount)
  const closing = useTabs((s) => s.closing)
  const state = useStudio((s) => s.documents.find(({ document }) => document === closing))
  const cancel = () => {
    useTabs.setState({ closing: null })
    showDialog(null)
  }
  return (
    <Modal opened={opened} onClose={cancel} title={<b>Close {state?.title}</b>} size="md">
      {state && <Choice key={openCount} state={state} cancel={cancel} />}
    </Modal>
  )
}

function Choice({ state, cancel }: { state: DocumentState; cancel: () => void }) {
  const [path, setPath] = useState(state.path ?? `${fileName(state.title)}.json`)
  const [fault, setFault] = useState<Refusal | null>(null)
  /** Whether the file exists, so that saving needs a confirmation. */
  const [exists, setExists] = useState(false)
  const { document } = state

  const close = async (discard: boolean) => {
    cancel()
    await closeDocument(document, discard)
  }
  const save = async (overwrite: boolean) => {
    const file = /\.json$/i.test(path.trim()) ? path.trim() : `${path.trim()}.json`
    try {
      await connection.ask({ kind: 'save', document, path: state.path ? '' : file, overwrite })
      await close(false)
    } catch (error) {
      if (!(error instanceof Refusal)) throw error
      setFault(error)
      setExists(state.path !== null || (await projectFiles()).files.includes(file))
    }
  }

  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        void save(exists)
      }}
    >
      <Stack gap="sm">
        <Text size="sm">
          {state.path
            ? `The changes since the last save of ${state.path} are not saved.`
            : 'The document has no file yet.'}{' '}
          Discarded changes cannot be recovered.
        </Text>
        {!state.path && (
          <TextInput
            label="File"
            description="A name in the project folder; missing folders are created."
            data-autofocus
            value={path}
            onChange={({ currentTarget }) => {
              setPath(currentTarget.value)
              setFault(null)
              setExists(false)
            }}
          />
        )}
        {fault && (
          <Alert color="yellow" title={fault.what}>
            {fault.fix}
          </Alert>
        )}
        <Group justify="space-between" gap="xs">
          <Button variant="subtle" color="red" onClick={() => void close(true)}>
            Discard
          </Button>
          <Group gap="xs">
            <Button variant="default" onClick={cancel}>
              Cancel
            </Button>
            <Button
              type="submit"
              color={exists ? 'red' : undefined}
              disabled={!path.trim()}
              data-autofocus={state.path ? true : undefined}
            >
              {exists ? 'Overwrite and close' : 'Save and close'}
            </Button>
          </Group>
        </Group>
      </Stack>
    </form>
  )
}

const fileName = (title: string): string => title.trim().replace(/[^\w. -]+/g, '_') || 'untitled'
