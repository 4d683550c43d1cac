import { useMemo } from 'react'
import { goTo } from './documents/bookmarks'
import { useBookmarks } from './documents/use_bookmarks'
import { matchingBookmarks } from './model/bookmarks'
import { commands } from './commands'
import { showDialog, useDialogs } from './dialogs'
import { PickList } from './library/pick_list'

/** The command palette, Ctrl+K: commands, and bookmarks of the shown document. Find is a separate dialog. */
export function CommandPalette() {
  const opened = useDialogs((s) => s.open === 'commands')
  const typed = useDialogs((s) => s.typed)
  const matches = useMemo(() => {
    const words = typed.toLowerCase().split(/\s+/).filter(Boolean)
    const available = opened ? commands().filter(({ enabled: available }) => available?.() ?? true) : []
    return available.filter(({ title }) => words.every((word) => title.toLowerCase().includes(word)))
  }, [opened, typed])
  const bookmarks = matchingBookmarks(useBookmarks(opened) ?? [], typed)
  return (
    <PickList
      opened={opened}
      onClose={() => showDialog(null)}
      label="Command"
      placeholder="What do you want to do?"
      list="Commands"
      typed={typed}
      onTyped={(next) => useDialogs.setState({ typed: next })}
      emptyText={`No command matches “${typed}”. To add a block, type its name on the sheet.`}
      items={[
        ...matches.map(({ title, keys }) => ({ key: title, title, ...(keys ? { keys } : {}) })),
        ...bookmarks.map(({ name, inside }) => ({
          key: [' ', ...inside, name].join('/'),
          title: name,
          note: ['Bookmark', ...(inside.length ? [`in ${inside.join(' › ')}`] : [])].join(' · '),
        })),
      ]}
      onPick={(index) => {
        const bookmark = bookmarks[index - matches.length]
        // Executed after the list has closed and the focus has returned.
        setTimeout(() => (bookmark ? void goTo(bookmark) : matches[index]?.run()))
      }}
    />
  )
}
