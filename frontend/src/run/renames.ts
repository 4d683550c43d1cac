import type { EventOf } from '../messages'
import { pathAfter, pathsAfter, textAfter, withKeysAfter, type Renamed } from '../model/renames'
import type { SinkView } from '../protocol'
import { scheduleFrame } from '../frames'
import { useStudio, type RunView } from '../store'
import { useRuns, type StoredRun } from './runs'
import { useShownValues } from './shown_values'
import { usePinnedParameters } from './pinned_parameters'

/*
 * Views of runs identify blocks, signals and parameters by their paths. When a block is renamed, also by
 * undo, these paths are updated. Scopes keep their curves, displays and wires keep their values, and tried
 * values remain with their parameters.
 */

const viewsAfter = (views: SinkView[], renamed: Renamed): SinkView[] =>
  views.map((view) => ({ ...view, block: pathAfter(view.block, renamed) }))

function storedAfter(run: StoredRun, renamed: Renamed): StoredRun {
  run.samples.rename(renamed)
  return {
    ...run,
    views: viewsAfter(run.views, renamed),
    trialValues: withKeysAfter(run.trialValues, renamed),
    tunings: run.tunings.map((tuning) => ({ ...tuning, parameter: pathAfter(tuning.parameter, renamed) })),
  }
}

/** The displayed data of a run after blocks were renamed. */
export const runViewAfter = (run: RunView, renamed: Renamed): RunView => ({
  ...run,
  message: textAfter(run.message, renamed),
  fault: run.fault && {
    ...run.fault,
    what: textAfter(run.fault.what, renamed),
    where: textAfter(run.fault.where, renamed),
  },
  views: viewsAfter(run.views, renamed),
  channels: run.channels.map((channel) => ({ ...channel, name: pathAfter(channel.name, renamed) })),
  tunables: run.tunables.map((tunable) => ({ ...tunable, path: pathAfter(tunable.path, renamed) })),
})

/** Rename the signals of the run that the server has. */
export function onRunRenamed({ run, renamed }: EventOf<'run_renamed'>): void {
  useRuns.setState((s) => ({
    runs: s.runs.map((stored) => (stored.key === run ? storedAfter(stored, renamed) : stored)),
  }))
  scheduleFrame()
}

/** Rename the signals of the earlier runs of a diagram, and everything that the user has chosen by path. */
export function onBlocksRenamed(document: string, inside: string[], renamed: Renamed): void {
  const last = useRuns.getState().runs.findLast((run) => run.document === document)
  useRuns.setState((s) => ({
    runs: s.runs.map((run) => (run.document === document && run !== last ? storedAfter(run, renamed) : run)),
    trialValues: withKeysAfter(s.trialValues, renamed),
  }))
  usePinnedParameters.setState(({ pinned, ranges }) => ({
    pinned: pathsAfter(pinned, renamed),
    ranges: withKeysAfter(ranges, renamed),
  }))
  useStudio.setState(({ notices }) => ({
    notices: notices.map((notice) => ({ ...notice, what: textAfter(notice.what, renamed) })),
  }))
  useShownValues.setState(({ pinned }) => ({ pinned: pathsAfter(pinned, renamed) }))
  const prefix = inside.map((name) => `${name}/`).join('')
  const nameAfter = (name: string) => pathAfter(prefix + name, renamed).slice(prefix.length)
  const isRenamed = (name: string) => nameAfter(name) !== name && !nameAfter(name).includes('/')
  const { selection, editing } = useStudio.getState()
  if ([...selection].some(isRenamed))
    useStudio.setState({ selection: new Set([...selection].map(nameAfter)) })
  if (editing !== null && isRenamed(editing)) useStudio.setState({ editing: nameAfter(editing) })
}
