import { useEffect, useState } from 'react'
import type { ParameterSetTable } from '../protocol'
import { useStudio } from '../store'
import { parameterSets } from './trial_values'

const DELAY_MS = 150

/** The parameter sets of the displayed model, requested again after each edit. */
export function useParameterSets(): ParameterSetTable | undefined {
  const document = useStudio((s) => s.document?.state.document)
  const version = useStudio((s) => s.document?.state.version)
  const [loaded, setLoaded] = useState<{ document: string; table: ParameterSetTable }>()
  useEffect(() => {
    if (document === undefined) return undefined
    let current = true
    const timer = setTimeout(() => {
      void parameterSets().then((table) => current && table && setLoaded({ document, table }))
    }, DELAY_MS)
    return () => {
      current = false
      clearTimeout(timer)
    }
  }, [document, version])
  return loaded?.document === document ? loaded?.table : undefined
}
