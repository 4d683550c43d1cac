import { useEffect } from 'react'
import { useDialogs } from '../dialogs'

const LISTS = new Set<string | null>(['find', 'commands', 'insert'])

/**
 * Handle the keys that are typed after a search list was requested and before its field has the focus:
 * characters go to the search text, Enter accepts the first entry, Escape closes the list.
 */
export function useTypeAhead(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      const { open, typed } = useDialogs.getState()
      const { key, ctrlKey, metaKey, altKey } = event
      if (!LISTS.has(open) || ctrlKey || metaKey || altKey) return
      if (document.activeElement?.closest('.pick-list')) return
      const changes = {
        Escape: { open: null },
        Enter: { accepted: true },
        Backspace: { typed: typed.slice(0, -1), accepted: false },
      }
      useDialogs.setState(
        changes[key as keyof typeof changes] ??
          (key.length === 1 ? { typed: typed + key, accepted: false } : {}),
      )
      event.preventDefault()
      event.stopPropagation()
    }
    addEventListener('keydown', onKeyDown, true)
    return () => removeEventListener('keydown', onKeyDown, true)
  }, [])
}
