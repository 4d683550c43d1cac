import { ask, useStudio } from '../store'
import { useCursor } from './cursor'
import { useRuns } from './runs'

async function run(): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  useCursor.setState({ time: null, playing: false })
  const { tried, speed } = useRuns.getState()
  await ask({ kind: 'run', document: document.state.document, speed, tuned: tried })
}

/** Start the model, or resume a paused run. */
export function startOrResume(): void {
  const { run: shown } = useStudio.getState()
  if (shown?.state === 'paused') void ask({ kind: 'control', run: shown.run, action: 'resume' })
  else if (shown?.state !== 'running') void run()
}
