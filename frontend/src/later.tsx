import { lazy, memo, Suspense, useEffect, type ComponentType } from 'react'
import { create } from 'zustand'
import { useContextMenu } from './context_menu_state'
import { useDialogs, useTour } from './dialogs'
import { useStudio } from './store'

const PATIENCE_MS = 1500
const parts: (() => Promise<unknown>)[] = []

/**
 * A part of the page that is not in the first download. It is fetched when the page has shown its document
 * and is idle, or earlier if it is needed. Until then, `words` is displayed in its place.
 */
export function later(load: () => Promise<ComponentType>, words = ''): ComponentType {
  const Part = lazy(() => load().then((part) => ({ default: part })))
  parts.push(load)
  return memo(() => (
    <Suspense fallback={words && <p className="empty">{words}</p>}>
      <Part />
    </Suspense>
  ))
}

/** Whether the first rendering is complete, so that deferred parts may load. */
export const useSettled = create(() => false)

/** Wait for the first rendering, then fetch the deferred parts. */
export function useSettling(): void {
  const shown = useStudio((s) => s.document !== null)
  useEffect(() => {
    if (!shown) return
    const settle = () => {
      useSettled.setState(true)
      for (const load of parts) void load()
    }
    const idle = requestIdleCallback(settle, { timeout: PATIENCE_MS })
    return () => cancelIdleCallback(idle)
  }, [shown])
}

/** Whether a dialog is requested, now or before the page was idle. */
export function useWanted(): boolean {
  const dialog = useDialogs((s) => s.open !== null)
  const touring = useTour((s) => s.stop !== null)
  const editing = useStudio((s) => s.editing !== null)
  const menu = useContextMenu((s) => s.opened)
  return dialog || touring || editing || menu
}
