import { Button, Group, Modal, Stack, TextInput } from '@mantine/core'
import { saveMotion, useTeaching } from './state'

/** Asks for the name of a trajectory file. */
export function SaveMotionDialog() {
  const { saving, refusal } = useTeaching()
  const close = () => useTeaching.setState({ saving: null, refusal: '' })
  const path = saving ?? ''
  const file = path.toLowerCase().endsWith('.csv') ? path : `${path}.csv`
  return (
    <Modal opened={saving !== null} onClose={close} title={<b>Save the trajectory</b>} size="sm">
      <form
        onSubmit={(event) => {
          event.preventDefault()
          void saveMotion(file, false)
        }}
      >
        <Stack gap="sm">
          <TextInput
            label="File in this folder"
            description="A table of t, q, qd, qdd, .csv; the block Trajectory and ab.load_trajectory read it."
            data-autofocus
            value={path}
            error={refusal || undefined}
            onChange={(event) => useTeaching.setState({ saving: event.currentTarget.value, refusal: '' })}
          />
          <Group justify="flex-end" gap="xs">
            <Button variant="default" onClick={close}>
              Cancel
            </Button>
            {refusal && (
              <Button color="red" variant="light" onClick={() => void saveMotion(file, true)}>
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
