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

/** Whether a robot view is of use: a block of the top sheet has a robot, or one of a sheet seen since. */
export function hasRobot(blocks: Record<string, SheetBlock>, isTop: boolean, before: boolean): boolean {
  return Object.values(blocks).some(({ parameters }) => parameters['robot']) || (!isTop && before)
}

/** Show the robot view only for a model with a robot: without it, diagram and scopes take its room. */
export function followRobot(api: DockviewApi, add: (id: string) => void): void {
  let shown = true
  const follow = ({ document }: { document: ReturnType<typeof useStudio.getState>['document'] }) => {
    if (!document) return
    const wanted = hasRobot(document.blocks, document.inside.length === 0, shown)
    if (wanted === shown) return
    shown = wanted
    const library = api.getPanel(LIBRARY)
    const width = library?.group.api.width
    if (wanted) add(ROBOT)
    const [robot, scopes, tune] = [ROBOT, SCOPES, TUNE].map((id) => api.getPanel(id))
    const to = wanted ? robot : scopes
    if (tune && to && tune.group === (wanted ? scopes : robot)?.group) moveBehind(tune.api, to)
    if (!wanted && robot) api.removePanel(robot)
    // The dock gives all panels in a row equal shares.
    if (width) library?.group.api.setSize({ width })
    if (wanted) robot?.group.api.setSize({ width: robotWidth() })
  }
  useStudio.subscribe((now, before) => now.document?.blocks !== before.document?.blocks && follow(now))
  follow(useStudio.getState())
}

type Panel = NonNullable<ReturnType<DockviewApi['getPanel']>>

/** Move a panel to the tabs of another one; it is visible there only if it was visible before. */
function moveBehind(panel: DockviewPanelApi, other: Panel): void {
  const front = panel.isVisible ? null : (other.group.activePanel ?? other)
  panel.moveTo({ group: other.group })
  front?.api.setActive()
}
