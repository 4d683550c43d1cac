import { create } from 'zustand'
import { Refusal } from '../connection'
import { showDialog, useDialogs } from '../dialogs'
import type { EventOf } from '../messages'
import { neighbour, restorableTabs, tabAfter, tabOf, updatedTabs, withTab, type Tab } from '../model/tabs'
import type { DocumentState } from '../protocol'
import { forgetRobot, leaveEditor, showRobot, useRobotEditor } from '../robot/editor/state'
import { ask, connection, refuse, showBlock, useStudio } from '../store'
import { storedData } from '../stored_data'
import { dropView, viewOf } from './document_views'

const STORAGE_KEY = 'armblocks-tabs'

interface Tabs {
  tabs: Tab[]
  /** The document that was chosen and that the server has not sent yet. */
  requested: string | null
  /** The document with unsaved changes whose closing the user has to confirm. */
  closing: string | null
}

/** The documents that are open in this client, in the order of their tabs. */
export const useTabs = create<Tabs>(() => ({ tabs: storedTabs(), requested: null, closing: null }))

function storedTabs(): Tab[] {
  const stored = storedData<Tab[]>(sessionStorage, STORAGE_KEY)
  return Array.isArray(stored) ? stored.filter((tab) => typeof tab?.document === 'string') : []
}

useTabs.subscribe(({ tabs }, before) => {
  if (tabs !== before.tabs) sessionStorage.setItem(STORAGE_KEY, JSON.stringify(tabs))
})

// Titles and paths change when a document is saved.
useStudio.subscribe(({ documents }, before) => {
  if (documents !== before.documents) useTabs.setState((s) => ({ tabs: updatedTabs(s.tabs, documents) }))
})

/** The document in front: the robot in the editor, else the diagram. */
export const documentInFront = (): string | undefined =>
  useRobotEditor.getState().current ?? useStudio.getState().document?.state.document

/** Add a tab for a document that this client shows. */
export function addTab(state: DocumentState): void {
  useTabs.setState((s) => ({
    tabs: withTab(s.tabs, tabOf(state)),
    requested: s.requested === state.document ? null : s.requested,
  }))
}

/** End the edit of a text field: its text belongs to the document that is shown now. */
function leaveField(): void {
  const { activeElement } = document
  if (activeElement instanceof HTMLInputElement || activeElement instanceof HTMLTextAreaElement)
    activeElement.blur()
}

/** Show the document of a tab, with the sheet that was shown last. */
export async function showTab(tab: Tab): Promise<void> {
  if (tab.document === documentInFront() && !useTabs.getState().requested) return
  leaveField()
  useTabs.setState({ requested: tab.document })
  await attach(tab, true)
  // The diagram behind the robot editor is not opened again.
  if (tab.document === useStudio.getState().document?.state.document) leaveEditor()
  useTabs.setState((s) => (s.requested === tab.document ? { requested: null } : {}))
}

/** Show the sheet at a path of subsystems of the document of a tab. */
export async function showSheetInTab(tab: Tab, inside: string[]): Promise<void> {
  const shown = useStudio.getState().document
  if (tab.document !== shown?.state.document) {
    leaveField()
    await attach(tab, true, inside)
  } else if (inside.join('/') !== shown.inside.join('/'))
    await ask({ kind: 'show_sheet', document: tab.document, inside })
  leaveEditor()
}

/** Show a block of the document of a tab, and select it. */
export async function showInTab(tab: Tab, inside: string[], block: string): Promise<void> {
  if (tab.document !== useStudio.getState().document?.state.document) {
    leaveField()
    await attach(tab, true, inside)
  }
  leaveEditor()
  await showBlock(inside, block)
}

/** Open the document of a tab on the server; returns its key, a new one if its file is open already. */
async function attach(
  { document, kind, path, origin }: Tab,
  inFront: boolean,
  inside = viewOf(document)?.inside ?? [],
): Promise<string | undefined> {
  const request = {
    kind: 'attach' as const,
    document,
    document_kind: kind,
    path,
    origin,
    in_front: inFront,
  }
  if (!inside.length) return ask(request)
  try {
    return await connection.ask({ ...request, inside })
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    return ask(request) // another client has removed or renamed the subsystem
  }
}

const dialogIsOpen = () => useDialogs.getState().open !== null || useStudio.getState().editing !== null

/** Whether the client has other tabs and no dialog, which belongs to the document in front. */
export const canStepTabs = (): boolean => useTabs.getState().tabs.length > 1 && !dialogIsOpen()

/** Whether the document in front can be closed now. */
export const canClose = (): boolean => documentInFront() !== undefined && !dialogIsOpen()

/** Show the tab a number of steps to the right of the one in front. */
export function stepTabs(steps: number): void {
  const { tabs, requested } = useTabs.getState()
  const next = tabAfter(tabs, requested ?? documentInFront(), steps)
  if (next) void showTab(next)
}

/** Close the document in front. */
export function closeInFront(): void {
  const document = documentInFront()
  if (document) void closeDocument(document)
}

/**
 * Close a document; with unsaved changes the user is asked. A document that another client shows stays open
 * there.
 */
export async function closeDocument(document: string, discard = false): Promise<void> {
  leaveField()
  const isTab = useTabs.getState().tabs.some((tab) => tab.document === document)
  const state = useStudio.getState().documents.find((known) => known.document === document)
  try {
    const isClosed = await connection.ask({ kind: 'close', document, discard })
    if (isTab) await leaveTab(document)
    else if (!isClosed)
      refuse({ what: 'another page shows this document', where: state?.title ?? '', fix: 'close it there' })
    forgetRobot(document)
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    const { documents } = useStudio.getState()
    const isDirty = documents.some((known) => known.document === document && known.dirty)
    if (!isDirty) {
      refuse(error)
      return
    }
    useTabs.setState({ closing: document })
    showDialog('close')
  }
}

/** Remove a tab; if its document was shown, show the next one. */
async function leaveTab(document: string): Promise<void> {
  const { tabs } = useTabs.getState()
  const next = neighbour(tabs, document)
  const wasInFront = documentInFront() === document
  useTabs.setState({ tabs: tabs.filter((tab) => tab.document !== document) })
  dropView(document)
  if (useRobotEditor.getState().current === document) leaveEditor()
  if (useStudio.getState().document?.state.document === document) {
    useStudio.setState({ document: null, run: null, selection: new Set() })
    await showDiagramBehind(next)
  }
  if (wasInFront && next && next.document !== documentInFront()) await showTab(next)
}

/** Show another diagram after the shown one was closed: that of a tab, else an empty one. */
async function showDiagramBehind(preferred: Tab | undefined): Promise<void> {
  const { tabs } = useTabs.getState()
  const robot = useRobotEditor.getState().current
  const diagram = preferred?.kind === 'diagram' ? preferred : tabs.find(({ kind }) => kind === 'diagram')
  if (diagram) await attach(diagram, false)
  else await ask({ kind: 'new', document_kind: 'diagram' })
  if (robot) showRobot(robot)
}

/** After a reconnection or a reload, let the server open the documents of the other tabs again. */
export async function reattachTabs(welcome: EventOf<'welcome'>): Promise<void> {
  const { robots } = useRobotEditor.getState()
  const shown = useStudio.getState().document?.state.document
  const { tabs } = useTabs.getState()
  const restorable = restorableTabs(tabs, welcome.documents, welcome.recoveries)
  const restored = await Promise.all(
    restorable.map(async (tab) => {
      if (tab.document === shown || robots[tab.document]) return tab
      const document = await attach(tab, false)
      return document === undefined ? [] : { ...tab, document }
    }),
  )
  useTabs.setState((s) => {
    // Meanwhile the user may have opened other documents.
    const opened = s.tabs.filter((tab) => !tabs.some(({ document }) => document === tab.document))
    const all = [...restored.flat(), ...opened]
    return {
      tabs: all.filter((tab, index) => all.findIndex(({ document }) => document === tab.document) === index),
    }
  })
}
