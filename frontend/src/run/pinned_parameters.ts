import { create } from 'zustand'

interface PinnedParameters {
  pinned: ReadonlySet<string>
  ranges: Record<string, [number, number]>
}

/** The parameters, `block.parameter`, that the panel "Tune" always lists, and the ranges of their sliders. */
export const usePinnedParameters = create<PinnedParameters>(() => ({ pinned: new Set(), ranges: {} }))
