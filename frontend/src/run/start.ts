import { ask, useStudio } from '../store'
import { stepCursor, useCursor } from './cursor'
import { useRuns } from './runs'

async function run(): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  useCursor.setState({ time: null, playing: false })
  const { trialValues, speed } = useRuns.getState()
  await ask({ kind: 'run', document: document.state.document, speed, tuned: trialValues })
}

/** Pause, step or stop the run; without an active run, a step moves the time cursor by one sample. */
export function control(action: 'pause' | 'step' | 'back' | 'stop'): void {
  const { run: currentRun } = useStudio.getState()
  if (!currentRun) return
  const busy = currentRun.state === 'running' || currentRun.state === 'paused'
  if (!busy && action === 'step') stepCursor(1)
  else if (!busy && action === 'back') stepCursor(-1)
  if (!busy) return
  if (action === 'back') useCursor.setState({ time: null, playing: false })
  void ask({ kind: 'control', run: currentRun.run, action })
}

/** Start the model, or resume a paused run. */
export function startOrResume(): void {
  const { run: currentRun } = useStudio.getState()
  if (currentRun?.state === 'paused') void ask({ kind: 'control', run: currentRun.run, action: 'resume' })
  else if (currentRun?.state !== 'running') void run()
}
