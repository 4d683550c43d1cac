import { create } from 'zustand'
import { storedData } from '../stored_data'

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

/** Display options of arms, shared by all views and stored. */
export const useViewOptions = create<ViewOptions>(() => ({
  ...DEFAULTS,
  ...storedData<Partial<ViewOptions>>(localStorage, STORAGE_KEY),
}))

export function toggle(option: keyof ViewOptions): void {
  useViewOptions.setState((now) => ({ [option]: !now[option] }))
  localStorage.setItem(STORAGE_KEY, JSON.stringify(useViewOptions.getState()))
}
