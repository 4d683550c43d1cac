/*
 * Keys that are pressed on the sheet while the result of an edit is awaited. They are queued and replayed
 * when the studio shows the result. Each key then acts on the state that the user expects: a copy that was
 * just pasted, the new name of a block, the sheet inside a subsystem.
 */

import { isForSheet } from './sheet_focus'

/** Awaited operations. */
let operations = 0
/** Whether the server is connected; without it, keys act at once and their edits are sent later. */
let connected = false
let replaying = false
const keys: KeyboardEvent[] = []

/** Hold the keys of the sheet until an operation and the steps that follow it directly have ended. */
export async function holdKeys<T>(operation: Promise<T>): Promise<T> {
  operations++
  try {
    return await operation
  } finally {
    // The caller continues in a microtask, in which it can select the new blocks.
    setTimeout(() => {
      operations--
      replay()
    })
  }
}

/** Called when the connection is opened or lost. */
export function setConnected(state: boolean): void {
  connected = state
  if (!connected) replay()
}

const areHeld = (): boolean => connected && operations > 0

const isModifier = ({ key }: KeyboardEvent): boolean =>
  ['Control', 'Shift', 'Alt', 'Meta', 'AltGraph'].includes(key)

/** Whether a key has the same effect on any displayed state: the server handles it after earlier edits. */
const isUndoOrRedo = ({ key, ctrlKey, metaKey, altKey }: KeyboardEvent): boolean =>
  (ctrlKey || metaKey) && !altKey && ['z', 'y'].includes(key.toLowerCase())

/** Whether a key acts at once: Esc closes and cancels what is displayed now. */
const actsAtOnce = (event: KeyboardEvent): boolean => event.key === 'Escape' || isUndoOrRedo(event)

function onKeyDown(event: KeyboardEvent): void {
  if (replaying || isModifier(event)) return
  // After a held key, all keys are held to preserve their order, also in a field that a held key opens.
  if (!keys.length && (!areHeld() || !isForSheet(event) || actsAtOnce(event))) return
  event.preventDefault()
  event.stopImmediatePropagation()
  keys.push(event)
}

/** Press the held keys one after the other, each after the studio shows the effect of the previous one. */
function replay(): void {
  if (areHeld()) return
  const event = keys.shift()
  if (!event) return
  replaying = true
  press(event)
  replaying = false
  // Without a server, all keys are replayed at once: the page may be closed.
  if (connected) setTimeout(replay)
  else replay()
}

/** The editing commands of keys. */
const DELETIONS = new Map([
  ['Backspace', 'delete'],
  ['Delete', 'forwardDelete'],
])

/** Press a key at the element that has the focus now, which may be a field that an earlier key has opened. */
function press({ key, code, ctrlKey, metaKey, altKey, shiftKey, repeat }: KeyboardEvent): void {
  const target = document.activeElement ?? document.body
  const copy = new KeyboardEvent('keydown', {
    key,
    code,
    ctrlKey,
    metaKey,
    altKey,
    shiftKey,
    repeat,
    bubbles: true,
    cancelable: true,
  })
  if (!target.dispatchEvent(copy) || ctrlKey || metaKey || altKey) return
  if (!(target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement)) return
  const deletion = DELETIONS.get(key)
  if (key.length === 1) document.execCommand('insertText', false, key)
  else if (deletion) document.execCommand(deletion)
}

/** Discard held Esc keys: they would close the menu or dialog that the pointer opens now. */
function onPointerDown(): void {
  keys.splice(0, keys.length, ...keys.filter(({ key }) => key !== 'Escape'))
}

addEventListener('keydown', onKeyDown, true)
addEventListener('pointerdown', onPointerDown, true)
// Edits of held keys are stored with the other pending edits.
addEventListener('pagehide', () => setConnected(false))
