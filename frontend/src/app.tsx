import { useComputedColorScheme } from '@mantine/core'
import {
  DockviewReact,
  type DockviewReadyEvent,
  type IDockviewPanelHeaderProps,
  type IDockviewPanelProps,
} from 'dockview-react'
import { lazy, Suspense, useEffect, useState, type ComponentType, type FunctionComponent } from 'react'
import { Canvas } from './canvas/canvas'
import { later, useSettled, useSettling, useWanted } from './later'
import { Palette } from './library/palette'
import { Notices } from './notices'
import { TopBar } from './run/top_bar'
import { Timeline } from './run/timeline'
import { DropZone } from './robot/drop'
import { useDesk } from './robot/editor/desk'
import { useStudio } from './store'

const RobotEditor = lazy(() => import('./robot/editor/robot_editor'))
const RobotView = later(async () => (await import('./robot/robot_view')).default, 'Loading the robot view …')
const Dialogs = later(async () => (await import('./all_dialogs')).AllDialogs)
const Explorer = later(async () => (await import('./library/explorer')).Explorer, 'Loading the tree …')
const Scopes = later(async () => (await import('./scopes/scopes')).Scopes, 'Loading the scopes …')
const SignalInspector = later(
  async () => (await import('./scopes/inspector')).SignalInspector,
  'Loading the signals …',
)
const TunePanel = later(async () => (await import('./run/tune_panel')).TunePanel, 'Loading the parameters …')

function ScopesPanel() {
  const ran = useStudio((s) => s.run !== null)
  return ran ? <Scopes /> : <p className="empty">Run the model (Ctrl+Enter) to see its scopes here.</p>
}

const panels: Record<string, FunctionComponent<IDockviewPanelProps>> = {
  library: Palette,
  explorer: inFront(Explorer),
  canvas: Canvas,
  scopes: ScopesPanel,
  tune: inFront(TunePanel),
  signals: inFront(SignalInspector),
  robot: RobotPanel,
}

/** With software rendering the first picture of the arm takes seconds: the diagram is shown first. */
function RobotPanel() {
  const settled = useSettled()
  return settled ? <RobotView /> : <p className="empty">Loading the robot view …</p>
}

/** A panel that is rendered when it is first shown: hidden panels cost nothing. */
function inFront(Part: ComponentType): FunctionComponent<IDockviewPanelProps> {
  return function Panel({ api }) {
    const [seen, setSeen] = useState(api.isVisible)
    useEffect(() => {
      if (api.isVisible) setSeen(true)
      const watch = api.onDidVisibilityChange(({ isVisible }) => isVisible && setSeen(true))
      return () => watch.dispose()
    }, [api])
    return seen ? <Part /> : null
  }
}

/** A tab without a close button: panels can be moved but not closed. */
function Tab({ api }: IDockviewPanelHeaderProps) {
  return <span className="tab">{api.title}</span>
}

/** The default layout: library, canvas, robot, and the scopes below. */
function arrange({ api }: DockviewReadyEvent): void {
  api.addPanel({ id: 'canvas', component: 'canvas', title: 'Diagram' })
  api.addPanel({
    id: 'library',
    component: 'library',
    title: 'Library',
    position: { referencePanel: 'canvas', direction: 'left' },
    initialWidth: 216,
  })
  api.addPanel({
    id: 'explorer',
    component: 'explorer',
    title: 'Model',
    position: { referencePanel: 'library' },
    inactive: true,
  })
  api.addPanel({
    id: 'robot',
    component: 'robot',
    title: 'Robot',
    position: { referencePanel: 'canvas', direction: 'right' },
    initialWidth: Math.min(640, 0.28 * innerWidth),
  })
  api.addPanel({
    id: 'tune',
    component: 'tune',
    title: 'Tune',
    position: { referencePanel: 'robot' },
    inactive: true,
  })
  api.addPanel({
    id: 'scopes',
    component: 'scopes',
    title: 'Scopes',
    position: { referencePanel: 'canvas', direction: 'below' },
    initialHeight: Math.min(460, 0.34 * innerHeight),
  })
  api.addPanel({
    id: 'signals',
    component: 'signals',
    title: 'Signals',
    position: { referencePanel: 'scopes' },
    inactive: true,
  })
}

/** A separate component: opening or closing a dialog renders no other part of the page. */
function DialogsWhenWanted() {
  const settled = useSettled()
  const wanted = useWanted()
  return (settled || wanted) && <Dialogs />
}

export function App() {
  const scheme = useComputedColorScheme('light')
  const editing = useDesk((s) => s.current !== null)
  useSettling()
  return (
    <div className="studio">
      <div className={editing ? 'behind' : 'sheets'} inert={editing}>
        <TopBar />
        <main className="dock">
          <DockviewReact
            className={scheme === 'dark' ? 'dockview-theme-dark' : 'dockview-theme-light'}
            components={panels}
            defaultTabComponent={Tab}
            onReady={arrange}
          />
        </main>
        <Timeline wires />
      </div>
      <DialogsWhenWanted />
      {editing && (
        <Suspense fallback={<p className="robot-editor empty">Loading the robot editor …</p>}>
          <RobotEditor />
        </Suspense>
      )}
      <DropZone />
      <Notices />
    </div>
  )
}
