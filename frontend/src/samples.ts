import { scheduleFrame } from './frames'
import { RunSamples } from './model/run_samples'

/** The samples of the displayed run; a new object for each run. */
export let samples = new RunSamples('', [], {})

export function showSamples(next: RunSamples): void {
  samples = next
  scheduleFrame()
}
