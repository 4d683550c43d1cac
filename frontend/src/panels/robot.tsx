import { later, useSettled } from '../later'
import type { Panel } from '../panel'
import { robotWidth } from '../robot_panel'

const RobotView = later(async () => (await import('../robot/robot_view')).default, 'Loading the robot view …')

/** With software rendering the first picture of the arm takes seconds, so the diagram is shown first. */
function RobotPanel() {
  const settled = useSettled()
  return settled ? <RobotView /> : <p className="empty">Loading the robot view …</p>
}

export const panel: Panel = {
  title: 'Robot',
  component: RobotPanel,
  order: 4,
  place: { beside: 'canvas', side: 'right', size: robotWidth() },
}
