/** Keys that a focused button handles; all other keys are handled by the sheet. */
const BUTTON_KEYS = new Set(['Enter', ' ', 'Tab'])

/** Whether an element is a button whose group does not use the arrow keys. */
const isButton = (element: Element | null): boolean =>
  element instanceof HTMLButtonElement &&
  !element.closest('[role="tablist"], [role="radiogroup"], [role="listbox"], .timeline, .stage')

/**
 * Whether a key acts on the sheet: the sheet, an element around the sheet or a button has the focus. A button
 * outside the sheet handles only the keys that press it.
 */
export function isForSheet({ target, key }: { target: EventTarget | null; key: string }): boolean {
  const sheet = document.querySelector('.canvas')
  const focused = target instanceof Element ? target : null
  if (
    !sheet ||
    focused instanceof HTMLInputElement ||
    focused?.closest('textarea, [role="dialog"], [role="menu"], [role="slider"], [role="tree"]')
  )
    return false
  // If the focused block was removed, nothing has the focus. After the selection by a rectangle, the panel
  // around the sheet has the focus.
  if (sheet.contains(focused) || focused?.contains(sheet)) return true
  return !BUTTON_KEYS.has(key) && (key.length === 1 || isButton(focused))
}

/** Move the focus to a block; returns whether the sheet shows it. */
export function focusBlock(name: string): boolean {
  const block = document.querySelector<HTMLElement>(
    `.canvas .react-flow__node[data-id="${CSS.escape(name)}"]`,
  )
  block?.focus({ preventScroll: true })
  return block !== null
}

/** Interval of the attempts to focus a block, ms: a closed dialog first returns the focus. */
const ATTEMPT_MS = 50
/** Number of attempts: a loaded computer closes a dialog and draws a new block late. */
const ATTEMPTS = 40

/**
 * Move the focus to a block when the sheet shows it and no dialog has the focus, so that Tab and Enter act on
 * the block. A field or a menu keeps the focus. `isWanted`: whether the block is still the one to focus.
 */
export function focusWhenShown(name: string, isWanted: () => boolean, attempts = ATTEMPTS): void {
  setTimeout(() => {
    if (!isWanted()) return
    const { activeElement } = document
    const isFree = isForSheet({ target: activeElement, key: 'a' })
    const isLater = isFree ? !focusBlock(name) : activeElement?.closest('[role="dialog"]')
    if (isLater && attempts > 1) focusWhenShown(name, isWanted, attempts - 1)
  }, ATTEMPT_MS)
}

/** Time after which a closed field is removed, and the result of its edit is drawn, ms. */
const RETURN_DELAY_MS = 50

/** Return the focus to a block after a key has closed a field on the sheet, unless something else has it. */
export const returnFocus = (name: string): void =>
  void setTimeout(() => {
    if (document.activeElement === document.body) focusBlock(name)
  }, RETURN_DELAY_MS)

let lastKey = ''
addEventListener('keydown', ({ key }) => (lastKey = key), true)

/** Whether Tab was the last key: other keys move the focus only with a dialog that they open or close. */
export const isByTab = (): boolean => lastKey === 'Tab'
