import { create } from 'zustand'
import { Refusal } from '../../connection'
import { connection, useStudio } from '../../store'
import { FileNameDialog } from '../file_name_dialog'
import { useRobotEditor, type OpenRobot } from './state'

interface SaveState {
  robot: string | null
  path: string
  refusal: string
}

const useSaving = create<SaveState>(() => ({ robot: null, path: '', refusal: '' }))

/** Save under the present name; without a file, ask for a name. */
export function saveRobot(): void {
  const { current, robots } = useRobotEditor.getState()
  const editedRobot = current ? robots[current] : undefined
  if (!editedRobot) return
  if (editedRobot.state.path) void write(editedRobot.state.document, '', false)
  else saveRobotAs(editedRobot)
}

/** Ask for a name and save under it. */
export function saveRobotAs({ name, state }: OpenRobot): void {
  useSaving.setState({
    robot: state.document,
    path: state.path ?? `${name.trim().replace(/[^\w.-]+/g, '_') || 'robot'}.json`,
    refusal: '',
  })
}

async function write(robot: string, path: string, overwrite: boolean): Promise<void> {
  try {
    await connection.ask({ kind: 'save', document: robot, path, overwrite })
    useSaving.setState({ robot: null })
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    const savedPath = path || useRobotEditor.getState().robots[robot]?.state.path || ''
    useSaving.setState({ robot, path: savedPath, refusal: error.what })
  }
}

export function SaveDialog() {
  const { robot, path, refusal } = useSaving()
  const files = useStudio((s) => s.welcome?.files) ?? []
  const file = path.endsWith('.json') ? path : `${path}.json`
  return (
    <FileNameDialog
      opened={robot !== null}
      title="Save the robot"
      description="A robot file, .json; missing folders are created."
      path={path}
      note={files.includes(path) ? 'A file with this name exists.' : ''}
      refusal={refusal}
      onPath={(typed) => useSaving.setState({ path: typed, refusal: '' })}
      onSave={(overwrite) => robot && void write(robot, file, overwrite)}
      onClose={() => useSaving.setState({ robot: null })}
    />
  )
}
