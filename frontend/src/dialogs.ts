import { create } from 'zustand'
import { ask, useStudio } from './store'

/**
 * All dialogs, except that of a block (`useStudio().edit`) and the tour.
 */
type Dialog =
  | 'commands'
  | 'find'
  | 'keys'
  | 'insert'
  | 'connect'
  | 'configuration'
  | 'mask'
  | 'save_as'
  | 'open'
  | 'recovery'

interface Dialogs {
  open: Dialog | null
  /** Distinguishes one opening from the next. */
  times: number
  /** Text typed into the lists that are searched. */
  typed: string
  /**
   * The subsystem whose mask is edited; `''` is the model. `ofSheet`: it is the one whose sheet is on the
   * screen.
   */
  of: string
  ofSheet: boolean
  /** Where a new block goes, in screen px; `null` is a free place. */
  at: { x: number; y: number } | null
}

/**
 * Which dialog is open: known before the dialogs themselves, which come after the first picture of the page.
 */
export const useDialogs = create<Dialogs>(() => ({
  open: null,
  times: 0,
  typed: '',
  of: '',
  ofSheet: false,
  at: null,
}))

/** Open a dialog, or close the one that is open. */
export function show(open: Dialog | null, typed = '', at: Dialogs['at'] = null): void {
  // A closing dialog still shows its content for a moment.
  useDialogs.setState((s) => (open ? { open, times: s.times + 1, typed, at } : { open }))
}

/** The visible stop of the tour; `null` while the tour is not shown. */
export const useTour = create<{ stop: number | null }>(() => ({ stop: null }))

export const openTour = (): void => useTour.setState({ stop: 0 })

/** Configuration parameters are those of a document. */
export function openConfiguration(): void {
  if (useStudio.getState().document) show('configuration')
}

/** The mask of a subsystem on the sheet; without one that of the sheet itself. */
export function openMask(block?: string): void {
  const { document } = useStudio.getState()
  if (!document) return
  useDialogs.setState({ of: block ?? document.inside.at(-1) ?? '', ofSheet: block === undefined })
  show('mask')
}

/** The files of the project folder as they are now, and those used last. */
export async function projectFiles(): Promise<{ files: string[]; recent: string[] }> {
  return (await ask({ kind: 'files' })) ?? { files: [], recent: [] }
}

/** Save under the present name; asks for one where there is none. */
export async function save(): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  if (document.state.path) await ask({ kind: 'save', document: document.state.document })
  else show('save_as')
}
