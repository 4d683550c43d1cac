import { create } from 'zustand'

/** The displayed items in addition to the bodies. */
export interface ViewOptions {
  frames: boolean
  axes: boolean
  limits: boolean
  path: boolean
  ghosts: boolean
  follow: boolean
}

const KEPT = 'armblocks-robot-view'
const START: ViewOptions = {
  frames: false,
  axes: false,
  limits: false,
  path: true,
  ghosts: true,
  follow: false,
}

function kept(): Partial<ViewOptions> {
  try {
    return JSON.parse(localStorage.getItem(KEPT) ?? '{}') as Partial<ViewOptions>
  } catch {
    return {}
  }
}

/** Display options of arms, shared by all views and stored. */
export const useViewOptions = create<ViewOptions>(() => ({ ...START, ...kept() }))

export function toggle(option: keyof ViewOptions): void {
  useViewOptions.setState((now) => ({ [option]: !now[option] }))
  localStorage.setItem(KEPT, JSON.stringify(useViewOptions.getState()))
}
