import { IconEdit } from '@tabler/icons-react'
import { useCallback, useMemo } from 'react'
import { ask } from '../store'
import { RunArm } from './run_arm'
import { posesFromRows, type RobotScene } from './scene'
import { Button } from './view_tools'

export interface RunStageProps {
  document: string
  inside: string[]
  block: string
  /** Whether the robot is drawn from bodies and joints on the sheet, and is edited there. */
  drawn: boolean
  scene: RobotScene
  /** Poses of the arm at rest, and its joint positions. */
  rest: number[][][]
  q: number[]
}

/** The arm of a block as moved by the run. */
export default function RunStage({ document, inside, block, drawn, scene, rest, q }: RunStageProps) {
  const poses = useMemo(() => posesFromRows(rest), [rest])
  const drawing = useCallback(
    () =>
      ask({
        kind: 'picture',
        document,
        inside,
        block,
        q,
        theme:
          globalThis.document.documentElement.dataset['mantineColorScheme'] === 'dark' ? 'dark' : 'light',
      }),
    [document, inside, block, q],
  )
  const edit = () => void ask({ kind: 'robot_of_block', document, inside, block })
  const entries = () => (drawn ? [] : [{ title: 'Edit this robot', run: edit }, null])
  return (
    <RunArm
      path={[...inside, block].join('/')}
      scene={scene}
      rest={poses}
      drawing={drawing}
      entries={entries}
      pedestal={!drawn}
    >
      {!drawn && <Button label="Edit this robot" icon={IconEdit} onClick={edit} />}
    </RunArm>
  )
}
