import { useComputedColorScheme, useMantineColorScheme } from '@mantine/core'
import { DockviewReact, type IDockviewPanelHeaderProps } from 'dockview-react'
import { lazy, Suspense, useEffect } from 'react'
import { setDock } from './dock'
import { DocumentTabs } from './documents/document_tabs'
import { deferred, useDeferredReady, usePrefetch, useDialogRequested } from './deferred'
import { Notices } from './notices'
import { panelsOf, type Panel } from './panel'
import { showRobotPanelIfNeeded } from './robot_panel'
import { useTypeAhead } from './library/type_ahead'
import { TopBar } from './run/top_bar'
import { Timeline } from './run/timeline'
import { DropZone } from './robot/drop'
import { useRobotEditor } from './robot/editor/state'
import { onTheme } from './theme'

const RobotEditor = lazy(() => import('./robot/editor/robot_editor'))
const Dialogs = deferred(async () => (await import('./all_dialogs')).AllDialogs)

/** Every file in `panels/` is a panel. */
const PANELS = panelsOf(import.meta.glob<{ panel: Panel }>('./panels/*.tsx', { eager: true }))

/** A tab without a close button: panels can be moved but not closed. */
function Tab({ api }: IDockviewPanelHeaderProps) {
  return <span className="tab">{api.title}</span>
}

/** A separate component: opening or closing a dialog renders no other component. */
function DialogsOnDemand() {
  const ready = useDeferredReady()
  const requested = useDialogRequested()
  return (ready || requested) && <Dialogs />
}

export function App() {
  const scheme = useComputedColorScheme('light')
  const { setColorScheme } = useMantineColorScheme()
  useEffect(() => onTheme(setColorScheme), [setColorScheme])
  const editing = useRobotEditor((s) => s.current !== null)
  usePrefetch()
  useTypeAhead()
  return (
    <div className="studio">
      <div className={editing ? 'behind' : 'sheets'} inert={editing}>
        <div className="head">
          <TopBar />
          {!editing && <DocumentTabs />}
        </div>
        <main className="dock">
          <DockviewReact
            className={scheme === 'dark' ? 'dockview-theme-dark' : 'dockview-theme-light'}
            components={PANELS.components}
            defaultTabComponent={Tab}
            onReady={(event) => {
              PANELS.arrange(event)
              setDock(event.api)
              showRobotPanelIfNeeded(event.api, (id) => PANELS.addTo(event.api, id))
            }}
          />
        </main>
        <Timeline wires />
      </div>
      <DialogsOnDemand />
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
