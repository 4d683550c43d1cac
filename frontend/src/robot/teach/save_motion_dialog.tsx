import { FileNameDialog } from '../file_name_dialog'
import { saveMotion, useTeaching } from './state'

/** Asks for the name of a trajectory file. */
export function SaveMotionDialog() {
  const { saving, refusal } = useTeaching()
  const path = saving ?? ''
  const file = path.toLowerCase().endsWith('.csv') ? path : `${path}.csv`
  return (
    <FileNameDialog
      opened={saving !== null}
      title="Save the trajectory"
      description="A table of t, q, qd, qdd, .csv; the block Trajectory and ab.load_trajectory read it."
      path={path}
      refusal={refusal}
      onPath={(typed) => useTeaching.setState({ saving: typed, refusal: '' })}
      onSave={(overwrite) => void saveMotion(file, overwrite)}
      onClose={() => useTeaching.setState({ saving: null, refusal: '' })}
    />
  )
}
