import { IconEdit } from '@tabler/icons-react'
import { useCallback, useEffect, useMemo, useState } from 'react'
import { ask, useStudio } from '../store'
import { RunArm } from './run_arm'
import { listed, type Poses, type RobotScene } from './scene'
import { Button } from './view_tools'

/** The arm of the first robot block: as the run moves it, or at rest before the first run. */
export default function RobotView() {
  const document = useStudio((s) => s.document?.state.document)
  const path = useStudio((s) => s.document?.inside)
  const blocks = useStudio((s) => s.document?.blocks)
  const inside = useMemo(() => path ?? [], [path])
  const block = useMemo(() => {
    const robots = Object.values(blocks ?? {}).filter(({ parameters }) => parameters['robot'])
    return (robots.find(({ type }) => type === 'RobotPlot') ?? robots[0])?.name
  }, [blocks])
  const said = block ? blocks?.[block]?.parameters : undefined
  const [shown, setShown] = useState<{ scene: RobotScene; rest: Poses; q: number[] } | null>(null)
  useEffect(() => {
    if (!document || !block) {
      setShown(null)
      return
    }
    let current = true
    void ask<RobotScene>({ kind: 'scene', document, inside, block }).then(async (scene) => {
      if (!scene || !current) return
      const q = scene.joints.map(({ limits }) => (limits ? Math.min(Math.max(0, limits[0]), limits[1]) : 0))
      const poses = await ask<number[][][]>({ kind: 'pose', document, inside, block, q })
      if (current && poses) setShown({ scene, rest: listed(poses), q })
    })
    return () => {
      current = false
    }
    // What the server says of the block is said anew when its robot changes, also where its name stays.
  }, [document, inside, block, said])
  if (!block) return <p className="empty">This sheet has no robot: add a Robot Plot to see its arm here.</p>
  if (!shown || !document) return <p className="empty">Loading the robot …</p>
  return <RunStage document={document} inside={inside} block={block} {...shown} />
}

interface RunStageProps {
  document: string
  inside: string[]
  block: string
  scene: RobotScene
  rest: Poses
  q: number[]
}

/** The arm of a block as the run moves it. */
function RunStage({ document, inside, block, scene, rest, q }: RunStageProps) {
  const drawing = useCallback(
    () => ask<string>({ kind: 'robot_picture', document, inside, block, q, theme: globalThis.document.documentElement.dataset['mantineColorScheme'] === 'dark' ? 'dark' : 'light' }),
    [document, inside, block, q],
  )
  return (
    <RunArm path={[...inside, block].join('/')} scene={scene} rest={rest} drawing={drawing}>
      <Button label="Edit this robot" icon={IconEdit} onClick={() => void ask({ kind: 'robot_of_block', document, inside, block })} />
    </RunArm>
  )
}
