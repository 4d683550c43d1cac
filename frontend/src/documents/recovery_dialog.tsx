import { Badge, Button, Group, Modal, Paper, Stack, Text } from '@mantine/core'
import { useEffect, useState } from 'react'
import type { Recovery } from '../protocol'
import { ask, useStudio } from '../store'
import { showDialog, useDialogs } from '../dialogs'

const dateText = (seconds: number) =>
  new Date(1000 * seconds).toLocaleString(undefined, { dateStyle: 'medium', timeStyle: 'short' })

const counted = (count: number, noun: string) => `${count} ${noun}${count === 1 ? '' : 's'}`

/** Unsaved work of the last session; offered when a client connects, and later in the menu. */
export function RecoveryDialog() {
  const recoveries = useStudio((s) => s.recoveries)
  const opened = useDialogs((s) => s.open === 'recovery')
  const [offered, setOffered] = useState(false)
  useEffect(() => {
    if (recoveries.length && !offered) {
      setOffered(true)
      if (!useStudio.getState().returned) showDialog('recovery')
    }
    if (!recoveries.length && useDialogs.getState().open === 'recovery') showDialog(null)
  }, [recoveries, offered])
  return (
    <Modal opened={opened} onClose={() => showDialog(null)} title={<b>Unsaved work</b>} size="lg">
      <Stack gap="sm">
        <Text size="sm" c="dimmed">
          The studio ended before these documents were saved. They can be recovered from its journal; no file
          has been changed. Entries without a choice remain in the menu.
        </Text>
        {recoveries.map((recovery) => (
          <RecoveryItem key={recovery.document} recovery={recovery} />
        ))}
      </Stack>
    </Modal>
  )
}

function RecoveryItem({ recovery }: { recovery: Recovery }) {
  const [confirming, setConfirming] = useState(false)
  const { kind, document, title, path, began, last, edits, parts, disk, missing } = recovery
  const act = (action: 'open' | 'keep_both' | 'discard') => {
    if (action !== 'discard' && useStudio.getState().recoveries.length === 1) showDialog(null)
    void ask({ kind: 'recover', document, action })
  }
  return (
    <Paper withBorder p="sm" role="group" aria-label={path ?? title}>
      <Group justify="space-between" align="flex-start" wrap="nowrap">
        <div>
          <Text fw={600}>{path ?? `${title}, never saved`}</Text>
          <Text size="sm">
            {counted(edits, 'edit')} from {dateText(began)} to {dateText(last)};{' '}
            {counted(parts, kind === 'robot' ? 'link' : 'block')}
          </Text>
        </div>
        {disk !== 'same' && (
          <Badge color="yellow" variant="light">
            {disk === 'gone' ? 'the file was deleted' : 'the file is newer'}
          </Badge>
        )}
      </Group>
      {disk === 'changed' && (
        <Text size="sm" mt={6}>
          Another program has changed {path} since. Keep both saves the recovered{' '}
          {kind === 'robot' ? 'robot' : 'drawing'} as a separate file beside it.
        </Text>
      )}
      {missing && (
        <Text size="sm" mt={6} c="var(--error)">
          {missing}
        </Text>
      )}
      <Group gap="xs" mt="sm" justify="flex-end">
        <Button
          variant="subtle"
          color="red"
          onClick={() => (confirming ? act('discard') : setConfirming(true))}
          onBlur={() => setConfirming(false)}
        >
          {confirming ? 'Discard permanently' : 'Discard'}
        </Button>
        {disk === 'changed' ? (
          <>
            <Button variant="default" onClick={() => act('open')}>
              Open
            </Button>
            <Button onClick={() => act('keep_both')}>Keep both</Button>
          </>
        ) : (
          <>
            {path && (
              <Button variant="default" onClick={() => act('keep_both')}>
                Keep both
              </Button>
            )}
            <Button onClick={() => act('open')}>Open</Button>
          </>
        )}
      </Group>
    </Paper>
  )
}
