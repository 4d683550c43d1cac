import { ActionIcon, Badge, Button, Group, NativeSelect, Text, TextInput, Tooltip } from '@mantine/core'
import {
  IconArrowBackUp,
  IconArrowForwardUp,
  IconDeviceFloppy,
  IconLayoutDistributeHorizontal,
  IconPlayerPauseFilled,
  IconPlayerPlayFilled,
  IconPlayerSkipBackFilled,
  IconPlayerSkipForwardFilled,
  IconPlayerStopFilled,
  IconPlus,
  IconSettings,
} from '@tabler/icons-react'
import { useEffect } from 'react'
import { commandOf } from '../commands'
import { openConfiguration, save, showDialog } from '../dialogs'
import { FileMenu } from '../documents/file_menu'
import { DocumentTitle } from '../documents/title'
import { alterDocument, ask, change, useStudio } from '../store'
import { ThemeSwitch } from '../theme_switch'
import { useRuns } from './runs'
import { control, startOrResume } from './start'

const SPEEDS = [
  { value: '', label: 'as fast as possible' },
  ...['0.1', '0.25', '0.5', '1', '2', '5', '10'].map((value) => ({ value, label: `${value} × real time` })),
]

/** Accept the text in the field that has the focus: a command such as a run uses the displayed values. */
function acceptTypedText(): void {
  const { activeElement } = document
  const isField = activeElement instanceof HTMLInputElement || activeElement instanceof HTMLTextAreaElement
  if (isField && !activeElement.closest('[role="dialog"]')) activeElement.blur()
}

export function TopBar() {
  const hasDocument = useStudio((s) => s.document !== null)

  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const command = commandOf(event, false)
      if (!command) return
      event.preventDefault()
      acceptTypedText()
      if (command.enabled?.() ?? true) command.run()
    }
    addEventListener('keydown', onKey)
    return () => removeEventListener('keydown', onKey)
  }, [])

  return (
    <header className="top-bar">
      <FileMenu />
      <DocumentTitle />
      <Group gap={2} wrap="nowrap" role="group" aria-label="Edit" className="edit-tools">
        <Undo />
        <Redo />
        <Tool
          label="Save (Ctrl+S)"
          icon={IconDeviceFloppy}
          disabled={!hasDocument}
          onClick={() => void save()}
        />
        <Tool
          label="Add a block (type on the sheet)"
          icon={IconPlus}
          disabled={!hasDocument}
          onClick={() => showDialog('insert')}
        />
        <Tool
          label="Arrange the blocks"
          icon={IconLayoutDistributeHorizontal}
          disabled={!hasDocument}
          onClick={() => void change({ kind: 'arrange' })}
        />
      </Group>
      <RunControls hasDocument={hasDocument} />
      <Tool
        label="Configuration parameters (Ctrl+E)"
        icon={IconSettings}
        disabled={!hasDocument}
        onClick={openConfiguration}
      />
      <RunState />
      <ThemeSwitch />
      <RunProgress />
    </header>
  )
}

function RunControls({ hasDocument }: { hasDocument: boolean }) {
  const state = useStudio((s) => s.run?.state)
  const runKey = useStudio((s) => s.run?.run)
  const speed = useRuns((s) => s.speed)
  const busy = state === 'running' || state === 'paused'
  return (
    <Group gap={4} role="group" aria-label="Run" className="run-controls">
      <Button
        size="compact-sm"
        leftSection={<IconPlayerPlayFilled size={14} />}
        disabled={!hasDocument || state === 'running'}
        onClick={startOrResume}
      >
        {state === 'paused' ? 'Resume' : 'Run'}
      </Button>
      <Tool
        label={busy ? 'Step back' : 'One sample back'}
        icon={IconPlayerSkipBackFilled}
        disabled={!runKey || state === 'running'}
        onClick={() => control('back')}
      />
      <Tool
        label="Pause"
        icon={IconPlayerPauseFilled}
        disabled={state !== 'running'}
        onClick={() => control('pause')}
      />
      <Tool
        label={busy ? 'Step' : 'One sample forward'}
        icon={IconPlayerSkipForwardFilled}
        disabled={!runKey || state === 'running'}
        onClick={() => control('step')}
      />
      <Tool label="Stop" icon={IconPlayerStopFilled} disabled={!busy} onClick={() => control('stop')} />
      <StopTime />
      <NativeSelect
        size="xs"
        w={160}
        aria-label="Speed"
        data={SPEEDS}
        value={speed ?? ''}
        onChange={({ currentTarget }) => {
          const chosen = currentTarget.value ? Number(currentTarget.value) : null
          useRuns.setState({ speed: chosen })
          if (busy && runKey) void ask({ kind: 'speed', run: runKey, speed: chosen })
        }}
      />
    </Group>
  )
}

/** Separate components, so that an edit does not render the other tools. */
function Undo() {
  const edit = useStudio((s) => s.document?.state.undo)
  return (
    <Tool
      label={edit ? `Undo ${edit} (Ctrl+Z)` : 'Nothing to undo'}
      icon={IconArrowBackUp}
      disabled={!edit}
      onClick={() => alterDocument('undo')}
    />
  )
}

function Redo() {
  const edit = useStudio((s) => s.document?.state.redo)
  return (
    <Tool
      label={edit ? `Redo ${edit} (Ctrl+Y)` : 'Nothing to redo'}
      icon={IconArrowForwardUp}
      disabled={!edit}
      onClick={() => alterDocument('redo')}
    />
  )
}

/**
 * The stop time of the model, s; the text is applied when the field loses the focus. The studio reads it,
 * also a formula such as `2*pi`; a notice shows why a text is refused.
 */
function StopTime() {
  const hasDocument = useStudio((s) => s.document !== null)
  const value = Number(useStudio((s) => s.document?.settings['stop_time']) ?? 10)
  const text = `${value} s`
  return (
    <TextInput
      key={text}
      size="xs"
      w={92}
      aria-label="Stop time, s"
      inputMode="decimal"
      defaultValue={text}
      onKeyDown={({ key, currentTarget }) => key === 'Enter' && currentTarget.blur()}
      onBlur={({ currentTarget: field }) => {
        const typed = field.value.trim().replace(/([\s\d.)])s$/, '$1')
        const showValue = () => void (field.value = text)
        if (!hasDocument || !typed || Number(typed) === value) showValue()
        // A new value is shown in a new field.
        else void change({ kind: 'settings', values: { stop_time: typed } }).then(showValue)
      }}
    />
  )
}

function Tool({
  label,
  icon: Icon,
  disabled,
  onClick,
}: {
  label: string
  icon: React.ComponentType<{ size: number }>
  disabled: boolean
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

/** The progress of a run, along the lower edge of the bar. */
function RunProgress() {
  const run = useStudio((s) => s.run)
  if (run?.state !== 'running' && run?.state !== 'paused') return null
  const part = run.stopTime ? Math.min(run.time / run.stopTime, 1) : 1
  return (
    <div
      className="run-progress"
      role="progressbar"
      aria-label="Progress of the run"
      aria-valuenow={Math.round(100 * part)}
      style={{ width: `${100 * part}%` }}
    />
  )
}

function RunState() {
  const run = useStudio((s) => s.run)
  if (!run) return <span className="run-state" />
  const colour = { running: 'orange', paused: 'gray', done: 'teal', stopped: 'gray', failed: 'red' }[
    run.state
  ]
  return (
    <span className="run-state">
      <Text size="sm" className="numbers">
        {run.time.toFixed(2)} s
      </Text>
      {run.realTimeFactor > 0 && (
        <Text size="xs" c="dimmed" className="numbers">
          {run.realTimeFactor >= 100 ? run.realTimeFactor.toFixed(0) : run.realTimeFactor.toFixed(1)} × real
          time
        </Text>
      )}
      <Badge
        color={colour}
        variant="light"
        styles={{ label: { color: 'var(--ink)' } }}
        title={run.message || run.fault?.what}
      >
        {run.state}
      </Badge>
    </span>
  )
}
