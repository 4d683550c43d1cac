import { create } from 'zustand'
import type { Wire } from './protocol'
import { ask, useStudio } from './store'

/**
 * All dialogs except the tour and the dialog of a block (`useStudio().edit`).
 */
type Dialog =
  | 'commands'
  | 'find'
  | 'keys'
  | 'close'
  | 'insert'
  | 'connect'
  | 'configuration'
  | 'mask'
  | 'parameter_sets'
  | 'bookmarks'
  | 'save_as'
  | 'open'
  | 'recovery'
  | 'dropped_table'

interface Dialogs {
  open: Dialog | null
  /** Number of dialogs opened so far: the React key, so that each opening has a new state. */
  openCount: number
  /** Text typed into the search lists. */
  typed: string
  /** Whether Enter was pressed before the field of a search list had the focus. */
  accepted: boolean
  /**
   * The subsystem whose mask is edited; `''` is the model. `ownsVisibleSheet`: the visible sheet is the sheet
   * of this subsystem.
   */
  maskOwner: string
  ownsVisibleSheet: boolean
  /** Position of a new block, screen px; `null` selects a free position. */
  at: { x: number; y: number } | null
  /** The port to which a new block is connected, and the wires that this connection replaces. */
  connectTo: { port: string; isOutput: boolean; instead?: Wire[] } | null
}

/**
 * The open dialog. This state is loaded before the dialogs, which load after the first rendering.
 */
export const useDialogs = create<Dialogs>(() => ({
  open: null,
  openCount: 0,
  typed: '',
  accepted: false,
  maskOwner: '',
  ownsVisibleSheet: false,
  at: null,
  connectTo: null,
}))

/** Open a dialog, or close the open one. */
export function showDialog(
  open: Dialog | null,
  typed = '',
  at: Dialogs['at'] = null,
  connectTo: Dialogs['connectTo'] = null,
): void {
  // A closing dialog still shows its content for a moment.
  useDialogs.setState((s) =>
    open ? { open, openCount: s.openCount + 1, typed, accepted: false, at, connectTo } : { open },
  )
}

/** The visible stop of the tour; `null` while the tour is not shown. */
export const useTour = create<{ stop: number | null }>(() => ({ stop: null }))

export const openTour = (): void => useTour.setState({ stop: 0 })

/** Open the configuration parameters of the displayed document, if there is one. */
export function openConfiguration(): void {
  if (useStudio.getState().document) showDialog('configuration')
}

/** Open the parameter sets of the displayed document, if there is one. */
export function openParameterSets(): void {
  if (useStudio.getState().document) showDialog('parameter_sets')
}

/** The bookmarks of the document; with `add`, the form for a bookmark of the present view is open. */
export function openBookmarks(form: 'add' | '' = ''): void {
  if (useStudio.getState().document) showDialog('bookmarks', form)
}

/** Edit the mask of a subsystem on the sheet; without a block, the mask of the sheet. */
export function openMask(block?: string): void {
  const { document } = useStudio.getState()
  if (!document) return
  useDialogs.setState({
    maskOwner: block ?? document.inside.at(-1) ?? '',
    ownsVisibleSheet: block === undefined,
  })
  showDialog('mask')
}

/** Request the present files of the project folder and the recent files. */
export async function projectFiles(): Promise<{ files: string[]; recent: string[] }> {
  return (await ask({ kind: 'files' })) ?? { files: [], recent: [] }
}

/** Save under the present name; without a file, ask for a name. */
export async function save(): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  if (document.state.path) await ask({ kind: 'save', document: document.state.document })
  else showDialog('save_as')
}
