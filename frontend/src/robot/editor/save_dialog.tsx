import { Button, Group, Modal, Stack, Text, TextInput } from '@mantine/core'
import { create } from 'zustand'
import { Refusal } from '../../connection'
import { connection, useStudio } from '../../store'
import { useRobotEditor, type OpenRobot } from './state'

interface SaveState {
  robot: string | null
  path: string
  refusal: string
}

const useSaving = create<SaveState>(() => ({ robot: null, path: '', refusal: '' }))

/** Save under the present name; without a file, ask for a name. */
export function saveRobot(): void {
  const { current, robots } = useRobotEditor.getState()
  const editedRobot = current ? robots[current] : undefined
  if (!editedRobot) return
  if (editedRobot.state.path) void write(editedRobot.state.document, '', false)
  else saveRobotAs(editedRobot)
}

/** Ask for a name and save under it. */
export function saveRobotAs({ name, state }: OpenRobot): void {
  useSaving.setState({
    robot: state.document,
    path: state.path ?? `${name.trim().replace(/[^\w.-]+/g, '_') || 'robot'}.json`,
    refusal: '',
  })
}

async function write(robot: string, path: string, overwrite: boolean): Promise<void> {
  try {
    await connection.ask({ kind: 'save', document: robot, path, overwrite })
    useSaving.setState({ robot: null })
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    const savedPath = path || useRobotEditor.getState().robots[robot]?.state.path || ''
    useSaving.setState({ robot, path: savedPath, refusal: error.what })
  }
}

export function SaveDialog() {
  const { robot, path, refusal } = useSaving()
  const files = useStudio((s) => s.welcome?.files) ?? []
  const close = () => useSaving.setState({ robot: null })
  return (
    <Modal opened={robot !== null} onClose={close} title={<b>Save the robot</b>} size="sm">
      <form
        onSubmit={(event) => {
          event.preventDefault()
          if (robot) void write(robot, path.endsWith('.json') ? path : `${path}.json`, false)
        }}
      >
        <Stack gap="sm">
          <TextInput
            label="File in this folder"
            description="A robot file, .json; missing folders are created."
            data-autofocus
            value={path}
            error={refusal || undefined}
            onChange={(event) => useSaving.setState({ path: event.currentTarget.value, refusal: '' })}
          />
          {files.includes(path) && !refusal && (
            <Text size="xs" c="dimmed">
              A file with this name exists.
            </Text>
          )}
          <Group justify="flex-end" gap="xs">
            <Button variant="default" onClick={close}>
              Cancel
            </Button>
            {refusal && robot && (
              <Button color="red" variant="light" onClick={() => void write(robot, path, true)}>
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
