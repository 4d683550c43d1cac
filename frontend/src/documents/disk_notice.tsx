import { Alert, Button, Group } from '@mantine/core'
import { IconAlertTriangle, IconFileAlert, IconHistory } from '@tabler/icons-react'
import { reload, useDesk, type RobotShown } from '../robot/editor/desk'
import { ask, useStudio } from '../store'
import { show } from '../dialogs'

interface Standing {
  path?: string | null
  disk: 'same' | 'changed' | 'gone'
  dirty: boolean
  journaled: boolean
}

/**
 * That somebody else has written the file of a drawing or robot, or that nothing keeps its edits: with what
 * can be done.
 */
export function FileNotice({
  path,
  disk,
  dirty,
  journaled,
  actions,
}: Standing & { actions: { reload: () => void; keepMine: () => void; saveAs: () => void } }) {
  return (
    <>
      {disk === 'changed' && (
        <Alert color="yellow" icon={<IconFileAlert />} title={`${path} has changed on the disk`}>
          {dirty ? 'Your edits are here and in the journal.' : 'You have no unsaved edits.'} Reloading can be
          undone.
          <Group gap="xs" mt="xs">
            <Button size="compact-sm" onClick={actions.reload}>
              Reload
            </Button>
            <Button size="compact-sm" variant="default" onClick={actions.keepMine}>
              Keep mine
            </Button>
            <Button size="compact-sm" variant="default" onClick={actions.saveAs}>
              Save as …
            </Button>
          </Group>
        </Alert>
      )}
      {disk === 'gone' && (
        <Alert color="yellow" icon={<IconFileAlert />} title={`${path} is deleted from the disk`}>
          What it held is here and in the journal; saving writes the file again.
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

/** Notices about the visible diagram or robot, and about other unsaved documents. */
export function DiskNotice() {
  const lost = useStudio((s) => (s.returned ? s.recoveries.length : 0))
  const robot = useDesk((s) => (s.current ? s.robots[s.current] : undefined))
  return (
    <>
      {lost > 0 && (
        <Alert
          color="blue"
          icon={<IconHistory />}
          title={lost === 1 ? 'Another document was not saved' : `${lost} other documents were not saved`}
        >
          The studio ended before; its journal has kept what was edited.
          <Group gap="xs" mt="xs">
            <Button size="compact-sm" variant="default" onClick={() => show('recovery')}>
              Look at {lost === 1 ? 'it' : 'them'}
            </Button>
          </Group>
        </Alert>
      )}
      {robot ? <OfRobot shown={robot} /> : <OfDrawing />}
    </>
  )
}

function OfRobot({ shown }: { shown: RobotShown }) {
  const { robot, path, disk, dirty, journaled } = shown
  const actions = {
    reload: () => reload(robot),
    keepMine: () => void ask({ kind: 'robot_keep_mine', robot }),
    saveAs: () => void import('../robot/editor/save_dialog').then(({ saveRobotAs }) => saveRobotAs(shown)),
  }
  return <FileNotice {...{ path, disk, dirty, journaled, actions }} />
}

function OfDrawing() {
  const state = useStudio((s) => s.document?.state)
  if (!state) return null
  const { document, path, disk = 'same', dirty, journaled = true } = state
  const actions = {
    reload: () => void ask({ kind: 'reload', document }),
    keepMine: () => void ask({ kind: 'keep_mine', document }),
    saveAs: () => show('save_as'),
  }
  return <FileNotice {...{ path, disk, dirty, journaled, actions }} />
}
