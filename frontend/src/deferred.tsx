import { lazy, memo, Suspense, useEffect, type ComponentType } from 'react'
import { create } from 'zustand'
import { useContextMenu } from './context_menu_state'
import { useDialogs, useTour } from './dialogs'
import { useStudio } from './store'

const IDLE_TIMEOUT_MS = 1500
const loaders: (() => Promise<unknown>)[] = []

/**
 * A part of the front end that is not in the first download. It is fetched when the front end has shown
 * its document and is idle, or earlier if it is needed. Until then, `placeholder` is displayed in its place.
 */
export function deferred<Props extends object>(
  load: () => Promise<ComponentType<Props>>,
  placeholder = '',
): ComponentType<Props> {
  const Part = lazy(() => load().then((part) => ({ default: part })))
  loaders.push(load)
  return memo((props: Props) => (
    <Suspense fallback={placeholder && <p className="empty">{placeholder}</p>}>
      <Part {...props} />
    </Suspense>
  ))
}

/** Whether the first rendering is complete, so that deferred parts may load. */
export const useDeferredReady = create(() => false)

/** Wait for the first rendering, then fetch the deferred parts. */
export function usePrefetch(): void {
  const shown = useStudio((s) => s.document !== null)
  useEffect(() => {
    if (!shown) return
    const prefetch = () => {
      useDeferredReady.setState(true)
      for (const load of loaders) void load()
    }
    const idle = requestIdleCallback(prefetch, { timeout: IDLE_TIMEOUT_MS })
    return () => cancelIdleCallback(idle)
  }, [shown])
}

/** Whether a dialog is requested, now or before the front end was idle. */
export function useDialogRequested(): boolean {
  const dialog = useDialogs((s) => s.open !== null)
  const touring = useTour((s) => s.stop !== null)
  const editing = useStudio((s) => s.editing !== null)
  const menu = useContextMenu((s) => s.opened)
  return dialog || touring || editing || menu
}
