/** Keys with Ctrl that edit the text of a field. */
const TEXT_KEYS = new Set(
  (
    'a c v x y z backspace delete insert home end arrowleft arrowright arrowup arrowdown ' +
    'control shift meta'
  ).split(' '),
)

/** Whether a key is a command, such as Ctrl+S, and does not edit the field that has the focus. */
export const isCommandKey = ({
  key,
  ctrlKey,
  metaKey,
  altKey,
}: Pick<KeyboardEvent, 'key' | 'ctrlKey' | 'metaKey' | 'altKey'>): boolean =>
  (ctrlKey || metaKey) && !altKey && !TEXT_KEYS.has(key.toLowerCase())
