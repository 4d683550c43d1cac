import type { DockviewApi, DockviewPanelApi } from 'dockview-react'
import type { SheetBlock } from './protocol'
import { useStudio } from './store'

const ROBOT = 'robot'
const SCOPES = 'scopes'
const LIBRARY = 'library'
/** The tab behind the robot view, which moves to the scopes while there is no robot. */
const TUNE = 'tune'

/** Initial width of the robot view, px. */
export const robotWidth = (): number => Math.min(640, 0.28 * innerWidth)

/** Whether the robot view is shown: for a robot or mechanism, and in subsystems if it was shown before. */
export function needsRobotView(
  blocks: Record<string, SheetBlock>,
  isTop: boolean,
  previously: boolean,
): boolean {
  return (
    Object.values(blocks).some(({ type, parameters }) => type === 'WorldFrame' || parameters['robot']) ||
    (!isTop && previously)
  )
}

/** Show the robot view only for a model with a robot: without a robot, diagram and scopes use its space. */
export function showRobotPanelIfNeeded(api: DockviewApi, add: (id: string) => void): void {
  let visible = true
  const update = ({ document }: { document: ReturnType<typeof useStudio.getState>['document'] }) => {
    if (!document) return
    const needed = needsRobotView(document.blocks, document.inside.length === 0, visible)
    if (needed === visible) return
    visible = needed
    const library = api.getPanel(LIBRARY)
    const width = library?.group.api.width
    if (needed) add(ROBOT)
    const [robot, scopes, tune] = [ROBOT, SCOPES, TUNE].map((id) => api.getPanel(id))
    const group = needed ? robot : scopes
    if (tune && group && tune.group === (needed ? scopes : robot)?.group) moveBehind(tune.api, group)
    if (!needed && robot) api.removePanel(robot)
    // The dock gives all panels in a row equal shares.
    if (width) library?.group.api.setSize({ width })
    if (needed) robot?.group.api.setSize({ width: robotWidth() })
  }
  useStudio.subscribe(
    (now, previously) => now.document?.blocks !== previously.document?.blocks && update(now),
  )
  update(useStudio.getState())
}

type Panel = NonNullable<ReturnType<DockviewApi['getPanel']>>

/** Move a panel to the tabs of another one; it is visible there only if it was visible before. */
function moveBehind(panel: DockviewPanelApi, other: Panel): void {
  const activePanel = panel.isVisible ? null : (other.group.activePanel ?? other)
  panel.moveTo({ group: other.group })
  activePanel?.api.setActive()
}
