import { Badge, Modal, NavLink, Stack, Text, TextInput } from '@mantine/core'
import { IconFile, IconHistory, IconPencil, IconRobot } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import { ask, bringToFront, useStudio } from '../store'
import { projectFiles, showDialog, useDialogs } from '../dialogs'
import { documentLabels } from '../model/tabs'
import { useTabs } from './tabs'

/** The Open dialog: open documents, recent files, and all files of the project folder. */
export function OpenDialog() {
  const opened = useDialogs((s) => s.open === 'open')
  const openCount = useDialogs((s) => s.openCount)
  return (
    <Modal opened={opened} onClose={() => showDialog(null)} title={<b>Open</b>} size="lg">
      <OpenList key={openCount} />
    </Modal>
  )
}

function OpenList() {
  const documents = useStudio((s) => s.documents)
  const current = useStudio((s) => s.document?.state.document)
  const [listing, setListing] = useState<{ files: string[]; recent: string[] } | null>(null)
  const [query, setQuery] = useState('')
  useEffect(() => void projectFiles().then(setListing), [])
  const matches = (name: string) => name.toLowerCase().includes(query.trim().toLowerCase())
  const labels = documentLabels(
    useTabs((s) => s.tabs),
    documents,
  )
  const closeAnd = (open: () => Promise<unknown>) => {
    showDialog(null)
    void open()
  }
  const open = documents.filter((entry) => entry.document !== current && matches(entry.path ?? entry.title))
  const recent = listing?.recent.filter(matches) ?? []
  const files = listing?.files.filter((file) => matches(file) && !recent.includes(file)) ?? []
  const openFirst = () => {
    const path = recent[0] ?? files[0]
    if (open[0]) closeAnd(() => bringToFront(open[0]!))
    else if (path !== undefined) closeAnd(() => ask({ kind: 'open', path }))
  }

  return (
    <Stack gap="xs">
      <TextInput
        aria-label="Search the files"
        placeholder="Search the files"
        data-autofocus
        value={query}
        onChange={(event) => setQuery(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === 'Enter') openFirst()
        }}
      />
      <div className="files">
        <Section title="Open documents">
          {open.map((entry) => (
            <NavLink
              key={entry.document}
              component="button"
              leftSection={entry.kind === 'robot' ? <IconRobot size={15} /> : <IconPencil size={15} />}
              label={entry.path ?? labels.get(entry.document)}
              rightSection={
                entry.dirty && (
                  <Badge variant="light" color="gray">
                    not saved
                  </Badge>
                )
              }
              onClick={() => closeAnd(() => bringToFront(entry))}
            />
          ))}
        </Section>
        <Section title="Recent files">
          {recent.map((path) => (
            <FileLink key={path} icon={IconHistory} path={path} closeAnd={closeAnd} />
          ))}
        </Section>
        <Section title="Files of this folder">
          {files.map((path) => (
            <FileLink key={path} icon={IconFile} path={path} closeAnd={closeAnd} />
          ))}
        </Section>
        {listing && !open.length && !recent.length && !files.length && (
          <p className="empty">
            {query
              ? 'No file matches.'
              : 'This folder has no models yet: save one, or start from an example.'}
          </p>
        )}
      </div>
    </Stack>
  )
}

function FileLink({
  icon: Icon,
  path,
  closeAnd,
}: {
  icon: typeof IconFile
  path: string
  closeAnd: (open: () => Promise<unknown>) => void
}) {
  return (
    <NavLink
      component="button"
      leftSection={<Icon size={15} />}
      label={path}
      onClick={() => closeAnd(() => ask({ kind: 'open', path }))}
    />
  )
}

function Section({ title, children }: { title: string; children: React.ReactNode[] }) {
  if (!children.length) return null
  return (
    <section>
      <Text size="xs" c="dimmed" fw={600} mt="xs" mb={2}>
        {title}
      </Text>
      {children}
    </section>
  )
}
