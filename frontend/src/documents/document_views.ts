import type { EventOf } from '../messages'
import type { Rectangle } from '../model/free_place'
import { RunSamples } from '../model/run_samples'
import { useCursor } from '../run/cursor'
import { useRuns } from '../run/runs'
import { showSamples } from '../samples'
import { storedData } from '../stored_data'
import { useStudio, type OpenDocument, type RunView } from '../store'

/** The displayed state of a diagram besides its content; restored when the diagram is shown again. */
interface DocumentView {
  inside: string[]
  selection: ReadonlySet<string>
  run: RunView | null
  strict: boolean
  trialValues: Record<string, unknown>
  /** The time cursor, s; `null` is the end of the run. */
  time: number | null
}

/** The part of a sheet that its panel shows: shift (px) and magnification. */
interface Viewport {
  x: number
  y: number
  zoom: number
}

const STORAGE_KEY = 'armblocks-views'

const views = new Map<string, DocumentView>()
/** The views of the sheets that the user has moved, by `sheetKey`. */
export const viewports = new Map<string, Viewport>()

/** Parts of sheets that are shown when the sheets are opened, by `sheetKey`. */
export const partsToShow = new Map<string, Rectangle>()

export const sheetKey = (document: string, inside: string[]): string => [document, ...inside].join('/')

const EMPTY_VIEW: DocumentView = {
  inside: [],
  selection: new Set(),
  run: null,
  strict: false,
  trialValues: {},
  time: null,
}

loadViews()

/** The view of a diagram that was shown before another diagram. */
export const viewOf = (document: string): DocumentView | undefined => views.get(document)

/** Delete the views of a closed document. */
export function dropView(document: string): void {
  views.delete(document)
  for (const key of viewports.keys()) if (key.split('/')[0] === document) viewports.delete(key)
}

interface StoredViews {
  sheets: [document: string, inside: string[], selection: string[]][]
  viewports: [key: string, viewport: Viewport][]
}

/** Store the views for a reload of the page; runs are sent by the server again. */
addEventListener('pagehide', () => {
  storeView()
  const stored: StoredViews = {
    sheets: [...views].map(([document, { inside, selection }]) => [document, inside, [...selection]]),
    viewports: [...viewports],
  }
  sessionStorage.setItem(STORAGE_KEY, JSON.stringify(stored))
})

/** Load the views from before a reload; views that cannot be read are ignored. */
function loadViews(): void {
  const stored = storedData<StoredViews>(sessionStorage, STORAGE_KEY)
  try {
    for (const [document, inside, selection] of stored?.sheets ?? [])
      views.set(document, { ...EMPTY_VIEW, inside: [...inside], selection: new Set(selection) })
    for (const [key, { x, y, zoom }] of stored?.viewports ?? [])
      if ([x, y, zoom].every(Number.isFinite)) viewports.set(key, { x, y, zoom })
  } catch {
    views.clear()
    viewports.clear()
  }
}

/** Store the view of the shown diagram, before another diagram is shown. */
export function storeView(): void {
  const { document, selection, run, strict } = useStudio.getState()
  if (!document) return
  const { trialValues } = useRuns.getState()
  const { time } = useCursor.getState()
  views.set(document.state.document, { inside: document.inside, selection, run, strict, trialValues, time })
}

/**
 * Restore the view of a diagram that is shown now. `run`: the key of its present run on the server. The
 * selection contains the blocks and notes that still exist on the same sheet.
 */
export function restoreView(shown: OpenDocument, serverRun: string | null): void {
  const view = views.get(shown.state.document) ?? EMPTY_VIEW
  const sameSheet = view.inside.join('/') === shown.inside.join('/')
  const stored = useRuns.getState().runs.find(({ key }) => key === view.run?.run)
  const isActive = view.run?.state === 'running' || view.run?.state === 'paused'
  const run =
    view.run && isActive && serverRun !== view.run.run
      ? { ...view.run, state: 'failed' as const, message: 'The studio ended during this run.' }
      : view.run
  useStudio.setState({
    run: stored ? run : null,
    strict: view.strict,
    editing: null,
    selection: new Set(
      sameSheet ? [...view.selection].filter((name) => shown.blocks[name] ?? shown.notes[name]) : [],
    ),
  })
  useRuns.setState({ trialValues: view.trialValues })
  useCursor.setState({ time: view.time, playing: false })
  showSamples(stored?.samples ?? new RunSamples('', [], {}))
}

/** Store the run of a diagram that is not shown. */
export function storeRun(document: string, run: RunView): void {
  views.set(document, { ...(views.get(document) ?? EMPTY_VIEW), run, strict: false, time: null })
}

/** Update the run of a diagram that is not shown. A fault sets `strict`. */
export function updateStoredRun({ document, run }: EventOf<'run_progress'>, change: Partial<RunView>): void {
  const view = views.get(document) ?? EMPTY_VIEW
  views.set(document, {
    ...view,
    strict: view.strict || Boolean(change.fault),
    run: view.run?.run === run ? { ...view.run, ...change } : view.run,
  })
}

/** Change the displayed data of a run, if its diagram is in another tab. */
export function changeStoredRun(run: string, change: (run: RunView) => RunView): void {
  for (const [document, view] of views)
    if (view.run?.run === run) views.set(document, { ...view, run: change(view.run) })
}
