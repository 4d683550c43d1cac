import { lazy, Suspense, useEffect, useMemo, useState } from 'react'
import { Refusal } from '../connection'
import { connection, refuse, useStudio } from '../store'
import type { RobotScene } from './scene'

const DRAW_FIRST = 'The mechanism is shown here when a joint connects a body with the World Frame.'

/** The 3-D code is loaded with the first robot; a model without a robot does not need it. */
const loadRunStage = () => import('./run_stage')
const RunStage = lazy(loadRunStage)

const refused = (error: unknown): void => {
  if (!(error instanceof Refusal)) throw error
  refuse(error)
}

/** A mechanism that is being drawn cannot always be assembled; the check marks the blocks. */
const whileDrawn = (error: unknown): undefined => {
  if (!(error instanceof Refusal)) throw error
}

/**
 * The arm of the first robot block, or the mechanism of the first World Frame: moved by the run, or at rest
 * before the first run. A mechanism is updated with every edit; while it cannot be assembled, the last one is
 * shown.
 */
export default function RobotView() {
  const document = useStudio((s) => s.document?.state.document)
  const path = useStudio((s) => s.document?.inside)
  const blocks = useStudio((s) => s.document?.blocks)
  const inside = useMemo(() => path ?? [], [path])
  const block = useMemo(() => {
    const robots = Object.values(blocks ?? {}).filter(({ parameters }) => parameters['robot'])
    const world = Object.values(blocks ?? {}).find(({ type }) => type === 'WorldFrame')
    return (robots.find(({ type }) => type === 'RobotPlot') ?? robots[0] ?? world)?.name
  }, [blocks])
  const drawn = block !== undefined && blocks?.[block]?.type === 'WorldFrame'
  const version = useStudio((s) => (drawn ? s.document?.state.version : 0))
  const blockParameters = block ? blocks?.[block]?.parameters : undefined
  const [shown, setShown] = useState<{ scene: RobotScene; rest: number[][][]; q: number[] } | null>(null)
  useEffect(() => {
    if (!document || !block) {
      setShown(null)
      return
    }
    let current = true
    void loadRunStage()
    const place = { document, inside, block }
    const show = async () => {
      const scene = await connection.ask({ kind: 'scene', ...place })
      const q = scene.rest
      const rest = current ? await connection.ask({ kind: 'pose', ...place, q }) : undefined
      if (current && rest) setShown({ scene, rest, q })
    }
    void show().catch(drawn ? whileDrawn : refused)
    return () => {
      current = false
    }
    // The data of the block are requested again when its robot changes, even if its name does not.
  }, [document, inside, block, blockParameters, drawn, version])
  if (!block) return <p className="empty">This sheet has no robot: add a Robot Plot to see its arm here.</p>
  if (!shown && drawn) return <p className="empty">{DRAW_FIRST}</p>
  if (!shown || !document) return <p className="empty">Loading the robot …</p>
  return (
    <Suspense fallback={<p className="empty">Loading the robot …</p>}>
      <RunStage document={document} inside={inside} block={block} drawn={drawn} {...shown} />
    </Suspense>
  )
}
