import { newKey } from '../keys'
import { fromMessage, isSameTrigger, settingsOf, toMessage, type TriggerSettings } from '../model/trigger'
import { alteration, ask, useStudio } from '../store'
import { applySettings, useTrigger } from './trigger'

/*
 * The trigger belongs to the diagram and is saved with it. This is not part of `trigger.ts`, which notebooks
 * use as well: their frames have no server.
 */

/** Changes of one setting within this time are one undo step, ms. */
const GESTURE_MS = 5000

/** Number of changes whose replies are outstanding, and the version that contains the last one. */
let outstanding = 0
let newest = 0
let gesture = { settings: '', key: '', end: 0 }
/** Whether the page itself replaces the settings. */
let applying = false

const shown = () => useStudio.getState().document

/** Use the trigger of the shown diagram, unless the user has changed the settings since this state. */
function showTrigger(): void {
  const document = shown()
  if (!document || outstanding > 0 || document.state.version < newest) return
  const settings = fromMessage(document.scopeTrigger)
  if (isSameTrigger(settings, useTrigger.getState())) return
  applying = true
  applySettings(settings)
  applying = false
}

/** Send changed settings; the letters typed into one field are one undo step. */
async function store(settings: TriggerSettings, changed: string): Promise<void> {
  const document = shown()
  if (!document) return
  const now = performance.now()
  const key = gesture.settings === changed && now < gesture.end ? gesture.key : newKey()
  gesture = { settings: changed, key, end: now + GESTURE_MS }
  outstanding += 1
  const version = await ask({
    kind: 'change',
    ...alteration(document.state),
    gesture: key,
    edit: { kind: 'scope_trigger', trigger: toMessage(settings) },
  })
  outstanding -= 1
  if (version !== undefined && shown()?.state.document === document.state.document) newest = version
  showTrigger()
}

showTrigger()
useTrigger.subscribe((state, before) => {
  if (applying || isSameTrigger(state, before)) return
  const settings = settingsOf(state)
  const names = Object.keys(settings) as (keyof TriggerSettings)[]
  const changed = names.filter((name) => settings[name] !== before[name])
  void store(settings, changed.join(' '))
})
useStudio.subscribe(({ document }, before) => {
  if (document?.state.document !== before.document?.state.document) {
    newest = 0
    gesture = { settings: '', key: '', end: 0 }
    applying = true
    applySettings(fromMessage(document?.scopeTrigger ?? null))
    applying = false
  } else if (document !== before.document) showTrigger()
})
