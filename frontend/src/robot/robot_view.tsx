import { lazy, Suspense, useEffect, useMemo, useState } from 'react'
import { ask, useStudio } from '../store'
import type { RobotScene } from './scene'

/** The 3-D code is loaded with the first robot; a model without a robot does not need it. */
const loadRunStage = () => import('./run_stage')
const RunStage = lazy(loadRunStage)

/** The arm of the first robot block, as moved by the run, or at rest before the first run. */
export default function RobotView() {
  const document = useStudio((s) => s.document?.state.document)
  const path = useStudio((s) => s.document?.inside)
  const blocks = useStudio((s) => s.document?.blocks)
  const inside = useMemo(() => path ?? [], [path])
  const block = useMemo(() => {
    const robots = Object.values(blocks ?? {}).filter(({ parameters }) => parameters['robot'])
    return (robots.find(({ type }) => type === 'RobotPlot') ?? robots[0])?.name
  }, [blocks])
  const blockParameters = block ? blocks?.[block]?.parameters : undefined
  const [shown, setShown] = useState<{ scene: RobotScene; rest: number[][][]; q: number[] } | null>(null)
  useEffect(() => {
    if (!document || !block) {
      setShown(null)
      return
    }
    let current = true
    void loadRunStage()
    void ask({ kind: 'scene', document, inside, block }).then(async (scene) => {
      if (!scene || !current) return
      const q = scene.rest
      const poses = await ask({ kind: 'pose', document, inside, block, q })
      if (current && poses) setShown({ scene, rest: poses, q })
    })
    return () => {
      current = false
    }
    // The data of the block are requested again when its robot changes, even if its name does not.
  }, [document, inside, block, blockParameters])
  if (!block) return <p className="empty">This sheet has no robot: add a Robot Plot to see its arm here.</p>
  if (!shown || !document) return <p className="empty">Loading the robot …</p>
  return (
    <Suspense fallback={<p className="empty">Loading the robot …</p>}>
      <RunStage document={document} inside={inside} block={block} {...shown} />
    </Suspense>
  )
}
