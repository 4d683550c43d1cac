import { Button, Group, Modal, Stack, Text, TextInput } from '@mantine/core'
import { create } from 'zustand'
import { Refusal } from '../../connection'
import { line, useStudio } from '../../store'
import { useDesk, type OpenRobot } from './desk'

interface Saving {
  robot: string | null
  path: string
  refused: string
}

const useSaving = create<Saving>(() => ({ robot: null, path: '', refused: '' }))

/** Save under the present name; without a file, ask for a name. */
export function saveRobot(): void {
  const { current, robots } = useDesk.getState()
  const shown = current ? robots[current] : undefined
  if (!shown) return
  if (shown.state.path) void write(shown.state.document, '', false)
  else saveRobotAs(shown)
}

/** Ask for a name and save under it. */
export function saveRobotAs({ name, state }: OpenRobot): void {
  useSaving.setState({
    robot: state.document,
    path: state.path ?? `${name.trim().replace(/[^\w.-]+/g, '_') || 'robot'}.json`,
    refused: '',
  })
}

async function write(robot: string, path: string, overwrite: boolean): Promise<void> {
  try {
    await line.ask({ kind: 'save', document: robot, path, overwrite })
    useSaving.setState({ robot: null })
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    const now = path || useDesk.getState().robots[robot]?.state.path || ''
    useSaving.setState({ robot, path: now, refused: error.what })
  }
}

export function SaveDialog() {
  const { robot, path, refused } = useSaving()
  const files = useStudio((s) => s.welcome?.files) ?? []
  const close = () => useSaving.setState({ robot: null })
  return (
    <Modal opened={robot !== null} onClose={close} title="Save the robot" size="sm">
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
            error={refused || undefined}
            onChange={(event) => useSaving.setState({ path: event.currentTarget.value, refused: '' })}
          />
          {files.includes(path) && !refused && (
            <Text size="xs" c="dimmed">
              A file with this name exists.
            </Text>
          )}
          <Group justify="flex-end" gap="xs">
            <Button variant="default" onClick={close}>
              Cancel
            </Button>
            {refused && robot && (
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
