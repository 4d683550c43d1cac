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

const STORAGE_KEY = 'armblocks-robot-view'
const DEFAULTS: ViewOptions = {
  frames: false,
  axes: false,
  limits: false,
  path: true,
  ghosts: true,
  follow: false,
}

function storedOptions(): Partial<ViewOptions> {
  try {
    return JSON.parse(localStorage.getItem(STORAGE_KEY) ?? '{}') as Partial<ViewOptions>
  } catch {
    return {}
  }
}

/** Display options of arms, shared by all views and stored. */
export const useViewOptions = create<ViewOptions>(() => ({ ...DEFAULTS, ...storedOptions() }))

export function toggle(option: keyof ViewOptions): void {
  useViewOptions.setState((now) => ({ [option]: !now[option] }))
  localStorage.setItem(STORAGE_KEY, JSON.stringify(useViewOptions.getState()))
}
