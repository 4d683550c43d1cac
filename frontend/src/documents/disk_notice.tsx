import { Alert, Button, Group } from '@mantine/core'
import { IconAlertTriangle, IconFileAlert, IconHistory } from '@tabler/icons-react'
import { ask, useStudio } from '../store'
import { show } from './dialogs'

/** That somebody else has written the file, or that nothing keeps what is drawn: with what can be done. */
export function DiskNotice() {
  const state = useStudio((s) => s.document?.state)
  const lost = useStudio((s) => (s.returned ? s.recoveries.length : 0))
  if (!state) return null
  const { document, path, disk, dirty, journaled } = state
  return (
    <>
      {lost > 0 && (
        <Alert color="blue" icon={<IconHistory />} title={lost === 1 ? 'Another drawing was not saved' : `${lost} other drawings were not saved`}>
          The studio ended before; its journal has kept what was drawn.
          <Group gap="xs" mt="xs">
            <Button size="compact-sm" variant="default" onClick={() => show('recovery')}>
              Look at {lost === 1 ? 'it' : 'them'}
            </Button>
          </Group>
        </Alert>
      )}
      {disk === 'changed' && (
        <Alert color="yellow" icon={<IconFileAlert />} title={`${path} has changed on the disk`}>
          {dirty ? 'Your edits are here and in the journal.' : 'You have no edits that are not saved.'} Reloading can be undone.
          <Group gap="xs" mt="xs">
            <Button size="compact-sm" onClick={() => void ask({ kind: 'reload', document })}>
              Reload
            </Button>
            <Button size="compact-sm" variant="default" onClick={() => void ask({ kind: 'keep_mine', document })}>
              Keep mine
            </Button>
            <Button size="compact-sm" variant="default" onClick={() => show('save_as')}>
              Save as …
            </Button>
          </Group>
        </Alert>
      )}
      {disk === 'gone' && (
        <Alert color="yellow" icon={<IconFileAlert />} title={`${path} is gone from the disk`}>
          The drawing is here and in the journal; saving writes the file again.
        </Alert>
      )}
      {!journaled && (
        <Alert color="red" icon={<IconAlertTriangle />} title="The journal cannot be written">
          What you draw is only in memory: save it. The disk may be full.
        </Alert>
      )}
    </>
  )
}
