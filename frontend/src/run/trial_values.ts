import { create } from 'zustand'
import { newKey } from '../keys'
import { changedTrials } from '../model/parameter_sets'
import type { ParameterSetTable, SetParameter } from '../protocol'
import { ask, useStudio } from '../store'
import { useRuns } from './runs'

type Values = Record<string, unknown>

/** Parameters of the parameter sets, which may be inside subsystems that are not displayed. */
export const useKnownParameters = create<{ parameters: ReadonlyMap<string, SetParameter> }>(() => ({
  parameters: new Map(),
}))

function send(values: Values): void {
  const { run } = useStudio.getState()
  if ((run?.state === 'running' || run?.state === 'paused') && Object.keys(values).length)
    void ask({ kind: 'tune', run: run.run, values })
}

const unsentValues = new Map<string, unknown>()

/** Try a value; at most once a frame while a slider moves. */
export function tryValue(path: string, value: unknown): void {
  useRuns.setState((s) => ({ trialValues: { ...s.trialValues, [path]: value } }))
  if (!unsentValues.size)
    requestAnimationFrame(() => {
      send(Object.fromEntries(unsentValues))
      unsentValues.clear()
    })
  unsentValues.set(path, value)
}

/** The parameter sets, with the model's values of their parameters and of the parameters in `also`. */
export async function parameterSets(
  also = Object.keys(useRuns.getState().trialValues),
): Promise<ParameterSetTable | undefined> {
  const document = useStudio.getState().document?.state.document
  if (document === undefined) return undefined
  const table = await ask({ kind: 'parameter_sets', document, also })
  if (!table) return undefined
  useKnownParameters.setState({
    parameters: new Map(table.parameters.filter(({ tunable }) => tunable).map((one) => [one.path, one])),
  })
  return table
}

/**
 * Replace all tried values; the next run starts with the new values. In a run in progress, parameters that
 * are no
 * longer tried return to the values of the model.
 */
export async function setTrialValues(next: Values): Promise<void> {
  const before = useRuns.getState().trialValues
  const document = useStudio.getState().document?.state.document
  unsentValues.clear()
  useRuns.setState({ trialValues: next })
  const table = await parameterSets(Object.keys(before))
  if (!table || useStudio.getState().document?.state.document !== document) return
  const modelValues = new Map(table.parameters.map(({ path, value }) => [path, value ?? undefined]))
  // The user may have tried other values meanwhile.
  send(changedTrials(before, useRuns.getState().trialValues, (path) => modelValues.get(path)))
}

export async function dropTrialValues(paths: string[]): Promise<void> {
  const { trialValues } = useRuns.getState()
  await setTrialValues(
    Object.fromEntries(Object.entries(trialValues).filter(([path]) => !paths.includes(path))),
  )
}

/** Keep all tried values in the model, as one undo step. */
export async function keepTrialValues(): Promise<void> {
  const { document } = useStudio.getState()
  const { trialValues } = useRuns.getState()
  if (!document) return
  const edit = { kind: 'keep_tuned' as const, values: trialValues }
  const version = await ask({
    kind: 'change',
    document: document.state.document,
    key: newKey(),
    inside: [],
    edit,
  })
  if (version !== undefined) useRuns.setState({ trialValues: {} })
}
