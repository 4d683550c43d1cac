import '../../mantine_later.css'
import {
  ActionIcon,
  Alert,
  Button,
  Menu,
  SegmentedControl,
  Text,
  Tooltip,
  useComputedColorScheme,
} from '@mantine/core'
import {
  IconAlertTriangle,
  IconArrowBackUp,
  IconArrowForwardUp,
  IconArrowLeft,
  IconChevronDown,
  IconDeviceFloppy,
  IconPlus,
} from '@tabler/icons-react'
import { DockviewReact, type DockviewReadyEvent, type IDockviewPanelHeaderProps } from 'dockview-react'
import { lazy, Suspense, useEffect } from 'react'
import { commandOf } from '../../commands'
import { showDialog } from '../../dialogs'
import { alterDocument, ask, bringToFront, useStudio } from '../../store'
import { DocumentTabs } from '../../documents/document_tabs'
import { edit, leaveEditor, useRobotEditor, type OpenRobot } from './state'
import { JointsPanel } from './joints_panel'
import { ReadingsPanel } from './readings_panel'
import { RobotFields } from './robot_fields'
import { LinkTable } from './table'
import { TeachPanel } from '../teach/teach_panel'
import { saveRobot, SaveDialog } from './save_dialog'

const ArmPanel = lazy(() => import('./arm_panel'))
/** Window height above which both tables are visible at the same time, px. */
const TALL_PX = 1000
const BAR_PX = 44

const panels: Record<string, React.FunctionComponent> = {
  arm: () => (
    <Suspense fallback={<p className="empty">Loading the robot view …</p>}>
      <ArmPanel />
    </Suspense>
  ),
  joints: JointsPanel,
  teach: TeachPanel,
  readings: ReadingsPanel,
  kinematics: () => <Table which="kinematics" />,
  dynamics: () => <Table which="dynamics" />,
  robot: () => <Table which="robot" />,
}

function Tab({ api }: IDockviewPanelHeaderProps) {
  return <span className="tab">{api.title}</span>
}

/** The default layout: arm, joints, and read-outs or the panel Teach above, the tables below. */
function arrange({ api }: DockviewReadyEvent): void {
  const isTall = innerHeight > TALL_PX
  api.addPanel({ id: 'arm', component: 'arm', title: 'Arm' })
  api.addPanel({
    id: 'readings',
    component: 'readings',
    title: 'Read-outs',
    position: { referencePanel: 'arm', direction: 'right' },
  })
  api.addPanel({
    id: 'teach',
    component: 'teach',
    title: 'Teach',
    inactive: true,
    position: { referencePanel: 'readings' },
  })
  api.addPanel({
    id: 'joints',
    component: 'joints',
    title: 'Joints',
    position: { referencePanel: 'arm', direction: 'right' },
  })
  api.addPanel({
    id: 'kinematics',
    component: 'kinematics',
    title: 'Kinematics',
    position: { direction: 'below' },
    initialHeight: isTall ? 0.26 * innerHeight : Math.max(250, 0.37 * innerHeight),
  })
  api.addPanel({
    id: 'dynamics',
    component: 'dynamics',
    title: 'Dynamics',
    inactive: true,
    ...(isTall
      ? { position: { referencePanel: 'kinematics', direction: 'below' }, initialHeight: 0.24 * innerHeight }
      : { position: { referencePanel: 'kinematics' } }),
  })
  api.addPanel({
    id: 'robot',
    component: 'robot',
    title: 'Robot, base, tool',
    inactive: true,
    position: { referencePanel: isTall ? 'dynamics' : 'kinematics' },
  })
  // Sizes are set last, from left and top: a resized group takes space from the groups after it.
  const width = (minimum: number, share: number) =>
    Math.min(Math.max(minimum, share * innerWidth), 1.5 * minimum)
  const [joints, readings] = [width(300, 0.2), width(376, 0.26)]
  api.getPanel('arm')?.group.api.setSize({ width: innerWidth - joints - readings })
  api.getPanel('joints')?.group.api.setSize({ width: joints })
  if (!isTall) return
  const table = 0.2 * innerHeight
  api.getPanel('arm')?.group.api.setSize({ height: innerHeight - BAR_PX - 2 * table })
  api.getPanel('kinematics')?.group.api.setSize({ height: table })
}

function Table({ which }: { which: 'kinematics' | 'dynamics' | 'robot' }) {
  const shown = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const tables = useRobotEditor((s) => s.tables)
  if (!shown || !tables) return <p className="empty">Loading the tables …</p>
  if (which === 'robot') return <RobotFields shown={shown} columns={tables.robot} />
  return <LinkTable shown={shown} columns={tables[which]} actions={which === 'kinematics'} />
}

/** The editor of a robot: its tables, the arm, and its read-outs. */
export default function RobotEditor() {
  const scheme = useComputedColorScheme('light')
  const shown = useRobotEditor((s) => (s.current ? s.robots[s.current] : undefined))
  const key = shown?.state.document
  useEffect(() => {
    if (!key) return
    // Registered on the document, before the key handlers of the sheet and its toolbar on the window.
    const onKey = (event: KeyboardEvent) => {
      event.stopPropagation()
      const pressed = event.key.toLowerCase()
      if (event.key === '?' && !(event.target instanceof HTMLInputElement)) showDialog('keys')
      const command = commandOf(event, false)
      if (command?.inRobotEditor) {
        event.preventDefault()
        if (command.enabled?.() ?? true) command.run()
        return
      }
      if (!(event.ctrlKey || event.metaKey) || event.altKey) return
      if (pressed === 's') saveRobot()
      else if (pressed === 'z' && !event.shiftKey) undo()
      else if (pressed === 'y' || (pressed === 'z' && event.shiftKey)) redo()
      else return
      event.preventDefault()
    }
    document.addEventListener('keydown', onKey)
    return () => document.removeEventListener('keydown', onKey)
  }, [key])
  if (!shown) return null
  return (
    <div className="robot-editor" role="region" aria-label={`Robot ${shown.name}`}>
      <Bar shown={shown} />
      <DocumentTabs />
      <Notes />
      <div className="robot-dock">
        <DockviewReact
          className={scheme === 'dark' ? 'dockview-theme-dark' : 'dockview-theme-light'}
          components={panels}
          defaultTabComponent={Tab}
          onReady={arrange}
        />
      </div>
      <SaveDialog />
    </div>
  )
}

/** End the edit of a cell, and with it its undo step. */
function leaveCell(): void {
  if (document.activeElement instanceof HTMLElement) document.activeElement.blur()
}

function undoOrRedo(direction: 'undo' | 'redo'): void {
  leaveCell()
  const { current, robots } = useRobotEditor.getState()
  if (current) alterDocument(direction, robots[current]?.state)
}

const undo = () => undoOrRedo('undo')
const redo = () => undoOrRedo('redo')

function Bar({ shown }: { shown: OpenRobot }) {
  const angles = useRobotEditor((s) => s.angles)
  const robots = useStudio((s) => s.documents).filter(({ kind }) => kind === 'robot')
  const { state } = shown
  const model = useStudio((s) => s.document?.state.title)
  const last = shown.links.at(-1)!
  return (
    <header className="top-bar">
      <Button
        size="compact-sm"
        variant="default"
        leftSection={<IconArrowLeft size={14} />}
        onClick={leaveEditor}
      >
        {model ?? 'Diagram'}
      </Button>
      <Menu position="bottom-start" shadow="md">
        <Menu.Target>
          <Button
            size="compact-sm"
            variant="subtle"
            color="gray"
            rightSection={<IconChevronDown size={13} />}
            className="title"
            aria-label={`Robot ${shown.name}: other robots`}
          >
            {shown.name}
            {state.dirty && <span aria-label="changed">&nbsp;•</span>}
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          {robots.map((robot) => (
            <Menu.Item key={robot.document} onClick={() => void bringToFront(robot)}>
              {robot.title} <span className="unit">{robot.path ?? 'not saved'}</span>
            </Menu.Item>
          ))}
          <Menu.Divider />
          <RobotItems />
        </Menu.Dropdown>
      </Menu>
      <Text size="xs" c="dimmed" className="file">
        {state.path ?? (state.origin ? `a copy of ${state.origin}` : 'not saved yet')}
      </Text>
      <Tool
        label={state.undo ? `Undo ${state.undo} (Ctrl+Z)` : 'Nothing to undo'}
        icon={IconArrowBackUp}
        disabled={!state.undo}
        onClick={undo}
      />
      <Tool
        label={state.redo ? `Redo ${state.redo} (Ctrl+Y)` : 'Nothing to redo'}
        icon={IconArrowForwardUp}
        disabled={!state.redo}
        onClick={redo}
      />
      <Tool label="Save (Ctrl+S)" icon={IconDeviceFloppy} onClick={() => saveRobot()} />
      <Tool
        label="Add a joint at the end"
        icon={IconPlus}
        onClick={() => void edit({ kind: 'add_joint', after: last.name })}
      />
      <span className="spring" />
      <Findings shown={shown} />
      <Convention shown={shown} />
      <SegmentedControl
        size="xs"
        aria-label="Angles"
        data={[
          { value: 'deg', label: 'deg' },
          { value: 'rad', label: 'rad' },
        ]}
        value={angles}
        onChange={(value) => useRobotEditor.setState({ angles: value })}
      />
    </header>
  )
}

function Tool({
  label,
  icon: Icon,
  disabled = false,
  onClick,
}: {
  label: string
  icon: React.ComponentType<{ size: number }>
  disabled?: boolean
  onClick: () => void
}) {
  return (
    <Tooltip label={label} openDelay={400}>
      <ActionIcon variant="subtle" color="gray" aria-label={label} disabled={disabled} onClick={onClick}>
        <Icon size={17} />
      </ActionIcon>
    </Tooltip>
  )
}

/** Menu entries for new robots and copies of shipped ones. */
export function RobotItems() {
  const robots = useStudio((s) => s.welcome?.robots) ?? []
  return (
    <>
      <Menu.Item onClick={() => void ask({ kind: 'new', document_kind: 'robot' })}>New robot</Menu.Item>
      <Menu.Label>Shipped robots</Menu.Label>
      <div className="shipped-robots">
        {robots.map((shipped) => (
          <Menu.Item
            key={shipped}
            onClick={() => void ask({ kind: 'open_shipped', document_kind: 'robot', name: shipped })}
          >
            {shipped}
          </Menu.Item>
        ))}
      </div>
    </>
  )
}

function Findings({ shown }: { shown: OpenRobot }) {
  if (!shown.findings.length) return null
  const count = shown.findings.length
  return (
    <Menu position="bottom-end" shadow="md" width={380}>
      <Menu.Target>
        <Button
          size="compact-sm"
          variant="default"
          c="var(--warning)"
          bg="var(--warning-wash)"
          leftSection={<IconAlertTriangle size={13} />}
          className="findings"
        >
          {count === 1 ? '1 warning' : `${count} warnings`}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {shown.findings.map(({ link, what, fix }, k) => (
          <Menu.Item key={k} component="div" closeMenuOnClick={false}>
            <b>{link}</b>: {what} <span className="unit">{fix}</span>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  )
}

/** Change of the D-H convention: the same numbers reinterpreted, or the same arm converted. */
function Convention({ shown }: { shown: OpenRobot }) {
  if (!shown.convention) return null
  const other = shown.convention === 'standard' ? 'modified' : 'standard'
  const change = (keep_arm: boolean) => void edit({ kind: 'convention', convention: other, keep_arm })
  return (
    <Menu position="bottom-end" shadow="md" width={330}>
      <Menu.Target>
        <Button
          size="compact-sm"
          variant="default"
          rightSection={<IconChevronDown size={13} />}
          disabled={!shown.chain}
        >
          {shown.convention} D-H
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item onClick={() => change(true)}>
          Write the same arm as {other} D-H
          <Text size="xs" c="dimmed">
            The numbers change, the arm and its torques stay.
          </Text>
        </Menu.Item>
        <Menu.Item onClick={() => change(false)}>
          Read these numbers as {other} D-H
          <Text size="xs" c="dimmed">
            The numbers stay, the arm changes.
          </Text>
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  )
}

/** The notes from reading the file. */
function Notes() {
  const notes = useRobotEditor((s) => s.notes)
  if (!notes.length) return null
  return (
    <Alert
      color="yellow"
      variant="light"
      p="xs"
      withCloseButton
      closeButtonLabel="Close the notes"
      onClose={() => useRobotEditor.setState({ notes: [] })}
      icon={<IconAlertTriangle size={16} />}
    >
      {notes.map((note) => (
        <Text size="xs" key={note}>
          {note}
        </Text>
      ))}
    </Alert>
  )
}
