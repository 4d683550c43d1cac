import { Text, Tooltip } from '@mantine/core'
import { useEffect } from 'react'
import { useStudio } from '../store'

/** The document's name, and whether its file holds what is drawn; the window's title says the same. */
export function DocumentTitle() {
  const state = useStudio((s) => s.document?.state)
  const description = useStudio((s) => s.document?.description)
  const title = state?.title ?? 'armblocks'
  useEffect(() => {
    window.document.title = state ? `${state.dirty ? '• ' : ''}${title} – armblocks` : 'armblocks'
  }, [state, title])
  const kept = state?.dirty
    ? 'Not saved. The journal keeps it: you may close the page, and find it again when you come back.'
    : state?.path
      ? `Saved in ${state.path}`
      : 'As it began; nothing to save yet.'
  return (
    <Tooltip multiline maw={340} openDelay={400} label={description ? `${description} – ${kept}` : kept}>
      <Text fw={600} className="title" tabIndex={-1}>
        {title}
        {state?.dirty && <span aria-label="not saved"> •</span>}
      </Text>
    </Tooltip>
  )
}
