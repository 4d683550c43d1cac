import { Alert, Button, Group } from '@mantine/core'
import { IconAlertTriangle, IconFileAlert, IconHistory } from '@tabler/icons-react'
import type { DocumentState } from '../protocol'
import { useRobotEditor } from '../robot/editor/state'
import { alterDocument, ask, useStudio } from '../store'
import { showDialog } from '../dialogs'

/**
 * Notice that another program has changed the file of a document, or that its journal cannot be written,
 * with the possible actions.
 */
function FileNotice({ state, saveAs }: { state: DocumentState; saveAs: () => void }) {
  const { document, path, disk, dirty, journaled } = state
  return (
    <>
      {disk === 'changed' && (
        <Alert color="yellow" icon={<IconFileAlert />} title={`${path} has changed on the disk`}>
          {dirty ? 'Your edits are here and in the journal.' : 'You have no unsaved edits.'} Reloading can be
          undone.
          <Group gap="xs">
            <Button size="compact-sm" onClick={() => alterDocument('reload', state)}>
              Reload
            </Button>
            <Button
              size="compact-sm"
              variant="default"
              onClick={() => void ask({ kind: 'ignore_file_change', document })}
            >
              Keep mine
            </Button>
            <Button size="compact-sm" variant="default" onClick={saveAs}>
              Save as …
            </Button>
          </Group>
        </Alert>
      )}
      {disk === 'gone' && (
        <Alert color="yellow" icon={<IconFileAlert />} title={`${path} was deleted from the disk`}>
          Its content is here and in the journal; saving writes the file again.
        </Alert>
      )}
      {!journaled && (
        <Alert color="red" icon={<IconAlertTriangle />} title="The journal cannot be written">
          Your edits are in memory only: save them. The disk may be full.
        </Alert>
      )}
    </>
  )
}

/** Notices about the visible document, and about other unsaved documents. */
export function DiskNotice() {
  const otherRecoveries = useStudio((s) => (s.returned ? s.recoveries.length : 0))
  const robot = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const diagram = useStudio((s) => s.document?.state)
  const state = robot?.state ?? diagram
  const saveAs = () => {
    if (robot) void import('../robot/editor/save_dialog').then(({ saveRobotAs }) => saveRobotAs(robot))
    else showDialog('save_as')
  }
  return (
    <>
      {otherRecoveries > 0 && (
        <Alert
          color="blue"
          icon={<IconHistory />}
          title={
            otherRecoveries === 1
              ? 'Another document was not saved'
              : `${otherRecoveries} other documents were not saved`
          }
        >
          The studio ended before the edits were saved; its journal contains them.
          <Group gap="xs">
            <Button size="compact-sm" variant="default" onClick={() => showDialog('recovery')}>
              Show {otherRecoveries === 1 ? 'it' : 'them'}
            </Button>
          </Group>
        </Alert>
      )}
      {state && <FileNotice state={state} saveAs={saveAs} />}
    </>
  )
}
