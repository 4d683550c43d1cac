import { INITIAL_TRIGGER, isTriggerSettings, settingsOf, type TriggerSettings } from '../model/trigger'
import { storedData } from '../stored_data'
import { useStudio } from '../store'
import { applySettings, useTrigger } from './trigger'

/*
 * Each document has its own trigger, also after a reload of the page. This is not part of `trigger.ts`, which
 * notebooks use as well: their frames have no storage.
 */

const STORAGE_KEY = 'armblocks-triggers'

/** The settings of documents that are not shown, and those from before a reload. */
const triggers = new Map<string, TriggerSettings>()

const stored = storedData<unknown>(sessionStorage, STORAGE_KEY)
for (const entry of Array.isArray(stored) ? (stored as unknown[]) : []) {
  const [document, settings] = Array.isArray(entry) ? (entry as unknown[]) : []
  if (typeof document === 'string' && isTriggerSettings(settings))
    triggers.set(document, settingsOf(settings))
}

const shownDocument = () => useStudio.getState().document?.state.document

function store(document: string | undefined): void {
  if (document !== undefined) triggers.set(document, settingsOf(useTrigger.getState()))
}

/** Use the trigger of the shown document. */
const restore = () => applySettings(triggers.get(shownDocument() ?? '') ?? INITIAL_TRIGGER)

restore()
useStudio.subscribe((_, before) => {
  const previous = before.document?.state.document
  if (previous === shownDocument()) return
  store(previous)
  restore()
})
addEventListener('pagehide', () => {
  store(shownDocument())
  const open = new Set(useStudio.getState().documents.map(({ document }) => document))
  const kept = [...triggers].filter(([document]) => open.has(document))
  sessionStorage.setItem(STORAGE_KEY, JSON.stringify(kept))
})
