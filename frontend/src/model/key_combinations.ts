const ARROWS: Record<string, string> = { '→': 'arrowright', '←': 'arrowleft' }

/** Whether exactly the keys of a combination are pressed; combinations without Ctrl or Alt never match. */
export function arePressed(
  keys: string,
  event: Pick<KeyboardEvent, 'key' | 'code' | 'ctrlKey' | 'metaKey' | 'altKey' | 'shiftKey'>,
): boolean {
  return keys.split(', ').some((combination) => {
    const parts = combination.split('+')
    const key = parts.at(-1)!.toLowerCase()
    const [ctrl, alt] = [parts.includes('Ctrl'), parts.includes('Alt')]
    return (
      (ctrl || alt) &&
      (event.ctrlKey || event.metaKey) === ctrl &&
      event.altKey === alt &&
      event.shiftKey === parts.includes('Shift') &&
      // With Alt, the keyboards of Apple type another character.
      (event.key.toLowerCase() === (ARROWS[key] ?? key) ||
        (alt && event.key.charCodeAt(0) > 127 && event.code.toLowerCase() === `key${key}`))
    )
  })
}
