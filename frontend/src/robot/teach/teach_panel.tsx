import './teach.css'
import { MotionSection } from './motion_section'
import { PoseList } from './pose_list'
import { ToolSection } from './tool_section'

/** Teaching of the arm: the tool, recorded poses, and the motion through them. */
export function TeachPanel() {
  return (
    <div className="teach" role="group" aria-label="Teach">
      <ToolSection />
      <PoseList />
      <MotionSection />
    </div>
  )
}
