import { create } from 'zustand'
import { ask, useStudio } from '../store'

type Dialog = 'save_as' | 'open' | 'recovery'

/** Which of the dialogs about documents is open; `times` tells one opening from the next. */
export const useDialogs = create<{ open: Dialog | null; times: number }>(() => ({ open: null, times: 0 }))

export function show(open: Dialog | null): void {
  useDialogs.setState(({ times }) => ({ open, times: open ? times + 1 : times }))
}

/** The files of the project folder as they are now, and those used last. */
export async function projectFiles(): Promise<{ files: string[]; recent: string[] }> {
  return (await ask<{ files: string[]; recent: string[] }>({ kind: 'files' })) ?? { files: [], recent: [] }
}

/** Save under the present name; asks for one where there is none. */
export async function save(): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  if (document.state.path) await ask({ kind: 'save', document: document.state.document })
  else show('save_as')
}
