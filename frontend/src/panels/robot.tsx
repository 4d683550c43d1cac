import { deferred, useDeferredReady } from '../deferred'
import type { Panel } from '../panel'
import { robotWidth } from '../robot_panel'

const RobotView = deferred(
  async () => (await import('../robot/robot_view')).default,
  'Loading the robot view …',
)

/** With software rendering the first picture of the arm takes seconds, so the diagram is shown first. */
function RobotPanel() {
  const ready = useDeferredReady()
  return ready ? <RobotView /> : <p className="empty">Loading the robot view …</p>
}

export const panel: Panel = {
  title: 'Robot',
  component: RobotPanel,
  order: 4,
  place: { beside: 'canvas', side: 'right', size: robotWidth() },
}
