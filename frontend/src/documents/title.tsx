import { Text, Tooltip } from '@mantine/core'
import { useEffect } from 'react'
import { useStudio } from '../store'

/** The name of the document and whether it has unsaved changes; also in the window title. */
export function DocumentTitle() {
  const state = useStudio((s) => s.document?.state)
  const description = useStudio((s) => s.document?.description)
  const title = state?.title ?? 'armblocks'
  useEffect(() => {
    window.document.title = state ? `${state.dirty ? '• ' : ''}${title} – armblocks` : 'armblocks'
  }, [state, title])
  const saveState = state?.dirty
    ? 'Not saved. The journal keeps your changes even if you close the page.'
    : state?.path
      ? `Saved in ${state.path}`
      : 'No changes to save.'
  return (
    <Tooltip
      multiline
      maw={340}
      openDelay={400}
      label={[title, description, saveState].filter(Boolean).join(' – ')}
    >
      <Text fw={600} className="title" tabIndex={-1}>
        {title}
        {state?.dirty && <span aria-label="not saved"> •</span>}
      </Text>
    </Tooltip>
  )
}
