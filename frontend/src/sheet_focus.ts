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

/** Move the focus to a block. */
export const focusBlock = (name: string): void =>
  document
    .querySelector<HTMLElement>(`.canvas .react-flow__node[data-id="${CSS.escape(name)}"]`)
    ?.focus({ preventScroll: true })

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
