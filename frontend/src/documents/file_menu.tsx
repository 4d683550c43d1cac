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
import { showRobot, useDesk } from '../robot/editor/desk'
import { ask, useStudio } from '../store'
import { save, show } from '../dialogs'

/** Maximum number of files in the menu; the dialog lists all. */
const MOST_FILES = 12

/** The menu of documents: new, open, save, what is open, what can be recovered, and the examples. */
export function FileMenu() {
  const welcome = useStudio((s) => s.welcome)
  const recoveries = useStudio((s) => s.recoveries)
  const known = useStudio((s) => s.document !== null)
  const files = (welcome?.files ?? []).slice(0, MOST_FILES)
  return (
    <Menu position="bottom-start" shadow="md" width={340}>
      <Menu.Target>
        <ActionIcon variant="subtle" color="gray" aria-label="Menu">
          <IconMenu2 size={18} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown mah="80vh" style={{ overflow: 'auto' }}>
        <Menu.Item leftSection={<IconFilePlus size={15} />} onClick={() => void ask({ kind: 'new' })}>
          New diagram
        </Menu.Item>
        <Menu.Item leftSection={<IconRobot size={15} />} onClick={() => void ask({ kind: 'robot_open' })}>
          New robot
        </Menu.Item>
        <Menu.Item
          leftSection={<IconFolderOpen size={15} />}
          rightSection={<Kbd size="xs">Ctrl+O</Kbd>}
          onClick={() => show('open')}
        >
          Open …
        </Menu.Item>
        <Menu.Item
          leftSection={<IconDeviceFloppy size={15} />}
          rightSection={<Kbd size="xs">Ctrl+S</Kbd>}
          disabled={!known}
          onClick={() => void save()}
        >
          Save
        </Menu.Item>
        <Menu.Item
          leftSection={<IconDeviceFloppy size={15} />}
          rightSection={<Kbd size="xs">Ctrl+Shift+S</Kbd>}
          disabled={!known}
          onClick={() => show('save_as')}
        >
          Save as …
        </Menu.Item>
        {recoveries.length > 0 && (
          <Menu.Item
            leftSection={<IconHistory size={15} />}
            rightSection={<Badge size="sm">{recoveries.length}</Badge>}
            onClick={() => show('recovery')}
          >
            Recover …
          </Menu.Item>
        )}
        <OpenDocuments />
        <OpenRobots />
        {files.length > 0 && <Menu.Label>Files of this folder</Menu.Label>}
        {files.map((path) => (
          <Menu.Item key={path} onClick={() => void ask({ kind: 'open', path })}>
            {path}
          </Menu.Item>
        ))}
        <Menu.Label>Robots</Menu.Label>
        {(welcome?.robots ?? []).map((shipped) => (
          <Menu.Item key={shipped} onClick={() => void ask({ kind: 'robot_open', shipped })}>
            {shipped}
          </Menu.Item>
        ))}
        <Menu.Label>Examples</Menu.Label>
        {Object.entries(welcome?.examples ?? {}).map(([example, description]) => (
          <Menu.Item key={example} onClick={() => void ask({ kind: 'open', example })}>
            {example}
            <Text size="xs" c="dimmed">
              {description}
            </Text>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  )
}

function OpenDocuments() {
  const documents = useStudio((s) => s.documents)
  const here = useStudio((s) => s.document?.state.document)
  const others = documents.filter((entry) => entry.document !== here)
  return (
    <>
      {others.length > 0 && <Menu.Label>Open now</Menu.Label>}
      {others.map((entry) => (
        <Menu.Item
          key={entry.document}
          leftSection={<IconPencil size={15} />}
          rightSection={
            entry.dirty ? (
              <Text size="xs" c="dimmed">
                not saved
              </Text>
            ) : (
              <IconX
                size={14}
                role="img"
                aria-label={`Close ${entry.title}`}
                onClick={(event) => {
                  event.stopPropagation()
                  void ask({ kind: 'close', document: entry.document })
                }}
              />
            )
          }
          onClick={() => void ask({ kind: 'attach', document: entry.document })}
        >
          {entry.path ?? entry.title}
        </Menu.Item>
      ))}
    </>
  )
}

function OpenRobots() {
  const robots = Object.values(useDesk((s) => s.robots))
  return (
    <>
      {robots.length > 0 && <Menu.Label>Open robots</Menu.Label>}
      {robots.map(({ robot, name, path }) => (
        <Menu.Item key={robot} onClick={() => void showRobot(robot)}>
          {name} <span className="unit">{path ?? 'not saved'}</span>
        </Menu.Item>
      ))}
    </>
  )
}
