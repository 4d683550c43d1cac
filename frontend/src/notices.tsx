import { Alert, Stack } from '@mantine/core'
import { IconAlertTriangle } from '@tabler/icons-react'
import { useEffect, useRef } from 'react'
import { DiskNotice } from './documents/disk_notice'
import { useStudio } from './store'

/** Notices about refused requests and a lost connection, with remedies. */
export function Notices() {
  const notices = useStudio((s) => s.notices)
  const connectionState = useStudio((s) => s.connectionState)
  const started = useStudio((s) => s.welcome !== null)
  const dismiss = useStudio((s) => s.dismiss)
  const element = useHeightOfNotices()
  return (
    <Stack ref={element} className="notices" gap="xs" role="status" aria-live="polite">
      {started && connectionState === 'down' && (
        <Alert color="orange" icon={<IconAlertTriangle />} title="The studio does not answer">
          Your edits are stored here and sent after reconnection. If the studio was ended, start it again in
          the same folder.
        </Alert>
      )}
      {started && connectionState === 'rejected' && (
        <Alert
          color="orange"
          icon={<IconAlertTriangle />}
          title="The studio was restarted and does not accept this page"
        >
          Open the link that it printed in another tab. This tab then reconnects and sends your edits.
        </Alert>
      )}
      <DiskNotice />
      {notices.map(({ id, what, fix }) => (
        <Alert
          key={id}
          color="red"
          icon={<IconAlertTriangle />}
          title={what}
          withCloseButton
          closeButtonLabel="Dismiss"
          onClose={() => dismiss(id)}
        >
          {fix}
        </Alert>
      ))}
    </Stack>
  )
}

/** The height of the notices as a custom property: dialogs and the robot editor end above the notices. */
function useHeightOfNotices(): React.RefObject<HTMLDivElement | null> {
  const element = useRef<HTMLDivElement>(null)
  useEffect(() => {
    const observer = new ResizeObserver(([entry]) =>
      document.documentElement.style.setProperty(
        '--notices-height',
        `${entry?.borderBoxSize[0]?.blockSize ?? 0}px`,
      ),
    )
    if (element.current) observer.observe(element.current)
    return () => observer.disconnect()
  }, [])
  return element
}
