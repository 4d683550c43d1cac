import { Alert, Stack } from '@mantine/core'
import { IconAlertTriangle } from '@tabler/icons-react'
import { useStudio } from './store'

/** What the server refused, and that the line is down: in words, with what to do. */
export function Notices() {
  const notices = useStudio((s) => s.notices)
  const connected = useStudio((s) => s.connected)
  const started = useStudio((s) => s.welcome !== null)
  const dismiss = useStudio((s) => s.dismiss)
  return (
    <Stack className="notices" gap="xs" role="status" aria-live="polite">
      {started && !connected && (
        <Alert color="orange" icon={<IconAlertTriangle />} title="The studio does not answer">
          What you do is kept here and sent when it is back.
        </Alert>
      )}
      {notices.map(({ id, what, fix }) => (
        <Alert key={id} color="red" icon={<IconAlertTriangle />} title={what} withCloseButton closeButtonLabel="Dismiss" onClose={() => dismiss(id)}>
          {fix}
        </Alert>
      ))}
    </Stack>
  )
}
