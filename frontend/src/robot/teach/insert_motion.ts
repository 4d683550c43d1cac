import { insertBlock } from '../../canvas/insert'
import { sheetView } from '../../canvas/sheet_actions'
import { freeInView } from '../../model/free_place'
import { useStudio } from '../../store'
import { leaveEditor, useRobotEditor } from '../editor/state'
import { motionRows, pausePlayback } from './state'

/** Add a Trajectory block that plays the motion to the diagram, and show it there. */
export async function insertMotion(): Promise<void> {
  const { current, robots } = useRobotEditor.getState()
  const robot = current ? robots[current] : undefined
  const { document, library } = useStudio.getState()
  const type = library.get('Trajectory')
  if (!robot || !document || !type) return
  pausePlayback()
  const rows = await motionRows()
  if (!rows) return
  const boxes = Object.values(document.blocks).map(({ place: { x, y }, width, height }) => ({
    x,
    y,
    width,
    height,
  }))
  const { width, height } = type
  const view = sheetView.visible?.() ?? { x: 0, y: 0, width: 600, height: 400 }
  const place = freeInView({ width, height }, view, boxes)
  const name = await insertBlock(
    'Trajectory',
    { x: place.x + width / 2, y: place.y + height / 2 },
    { name: `motion of ${robot.name}`, parameters: { data: rows }, reveal: true },
  )
  if (name !== undefined) leaveEditor()
}
