import { ActionIcon, Badge, Kbd, Menu, Text } from '@mantine/core'
import {
  IconDeviceFloppy,
  IconFilePlus,
  IconFolderOpen,
  IconHistory,
  IconMenu2,
  IconPencil,
  IconRobot,
  IconX,
} from '@tabler/icons-react'
import type { DocumentState } from '../protocol'
import { ask, bringToFront, useStudio } from '../store'
import { save, showDialog } from '../dialogs'
import { documentLabels } from '../model/tabs'
import { closeDocument, useTabs } from './tabs'

/** Maximum number of files in the menu; the dialog lists all. */
const MAX_FILES = 12

/** The menu of documents: new, open, save, open documents, recoverable documents, examples. */
export function FileMenu() {
  const welcome = useStudio((s) => s.welcome)
  const recoveries = useStudio((s) => s.recoveries)
  const hasDocument = useStudio((s) => s.document !== null)
  const files = (welcome?.files ?? []).slice(0, MAX_FILES)
  return (
    <Menu position="bottom-start" shadow="md" width={340}>
      <Menu.Target>
        <ActionIcon variant="subtle" color="gray" aria-label="Menu">
          <IconMenu2 size={18} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown mah="80vh" style={{ overflow: 'auto' }}>
        <Menu.Item
          leftSection={<IconFilePlus size={15} />}
          onClick={() => void ask({ kind: 'new', document_kind: 'diagram' })}
        >
          New diagram
        </Menu.Item>
        <Menu.Item
          leftSection={<IconRobot size={15} />}
          onClick={() => void ask({ kind: 'new', document_kind: 'robot' })}
        >
          New robot
        </Menu.Item>
        <Menu.Item
          leftSection={<IconFolderOpen size={15} />}
          rightSection={<Kbd size="xs">Ctrl+O</Kbd>}
          onClick={() => showDialog('open')}
        >
          Open …
        </Menu.Item>
        <Menu.Item
          leftSection={<IconDeviceFloppy size={15} />}
          rightSection={<Kbd size="xs">Ctrl+S</Kbd>}
          disabled={!hasDocument}
          onClick={() => void save()}
        >
          Save
        </Menu.Item>
        <Menu.Item
          leftSection={<IconDeviceFloppy size={15} />}
          rightSection={<Kbd size="xs">Ctrl+Shift+S</Kbd>}
          disabled={!hasDocument}
          onClick={() => showDialog('save_as')}
        >
          Save as …
        </Menu.Item>
        {recoveries.length > 0 && (
          <Menu.Item
            leftSection={<IconHistory size={15} />}
            rightSection={<Badge size="sm">{recoveries.length}</Badge>}
            onClick={() => showDialog('recovery')}
          >
            Recover …
          </Menu.Item>
        )}
        <OpenDocuments />
        {files.length > 0 && <Menu.Label>Files of this folder</Menu.Label>}
        {files.map((path) => (
          <Menu.Item key={path} onClick={() => void ask({ kind: 'open', path })}>
            {path}
          </Menu.Item>
        ))}
        <Shipped />
      </Menu.Dropdown>
    </Menu>
  )
}

/** Copies of shipped robots and examples. */
function Shipped() {
  const welcome = useStudio((s) => s.welcome)
  return (
    <>
      <Menu.Label>Robots</Menu.Label>
      <div className="shipped-robots">
        {(welcome?.robots ?? []).map((shipped) => (
          <Menu.Item
            key={shipped}
            onClick={() => void ask({ kind: 'open_shipped', document_kind: 'robot', name: shipped })}
          >
            {shipped}
          </Menu.Item>
        ))}
      </div>
      <Menu.Label>Examples</Menu.Label>
      {Object.entries(welcome?.examples ?? {}).map(([example, description]) => (
        <Menu.Item
          key={example}
          onClick={() => void ask({ kind: 'open_shipped', document_kind: 'diagram', name: example })}
        >
          {example}
          <Text size="xs" c="dimmed">
            {description}
          </Text>
        </Menu.Item>
      ))}
    </>
  )
}

/** The other open diagrams, and the robots. */
function OpenDocuments() {
  const documents = useStudio((s) => s.documents)
  const current = useStudio((s) => s.document?.state.document)
  const labels = documentLabels(
    useTabs((s) => s.tabs),
    documents,
  )
  const others = documents.filter(({ document }) => document !== current)
  const diagrams = others.filter(({ kind }) => kind === 'diagram')
  const robots = others.filter(({ kind }) => kind === 'robot')
  return (
    <>
      {diagrams.length > 0 && <Menu.Label>Open now</Menu.Label>}
      {diagrams.map((state) => (
        <OpenItem key={state.document} state={state} label={labels.get(state.document)!}>
          {state.path ?? labels.get(state.document)}
        </OpenItem>
      ))}
      {robots.length > 0 && <Menu.Label>Open robots</Menu.Label>}
      {robots.map((state) => (
        <OpenItem key={state.document} state={state} label={labels.get(state.document)!}>
          {state.path ? state.title : labels.get(state.document)}{' '}
          {state.path && <span className="unit">{state.path}</span>}
        </OpenItem>
      ))}
    </>
  )
}

interface OpenItemProps {
  state: DocumentState
  label: string
  children: React.ReactNode
}

function OpenItem({ state, label, children }: OpenItemProps) {
  return (
    <Menu.Item
      leftSection={state.kind === 'robot' ? <IconRobot size={15} /> : <IconPencil size={15} />}
      rightSection={
        state.dirty ? (
          <Text size="xs" c="dimmed">
            not saved
          </Text>
        ) : (
          <IconX
            size={14}
            role="img"
            aria-label={`Close ${label}`}
            onClick={(event) => {
              event.stopPropagation()
              void closeDocument(state.document)
            }}
          />
        )
      }
      onClick={() => void bringToFront(state)}
    >
      {children}
    </Menu.Item>
  )
}
