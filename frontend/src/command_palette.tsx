import { useMemo } from 'react'
import { commands } from './commands'
import { showDialog, useDialogs } from './dialogs'
import { PickList } from './library/pick_list'

/** The command palette, Ctrl+K. Find is a separate dialog, Ctrl+F. */
export function CommandPalette() {
  const opened = useDialogs((s) => s.open === 'commands')
  const typed = useDialogs((s) => s.typed)
  const matches = useMemo(() => {
    const words = typed.toLowerCase().split(/\s+/).filter(Boolean)
    const available = opened ? commands().filter(({ enabled: available }) => available?.() ?? true) : []
    return available.filter(({ title }) => words.every((word) => title.toLowerCase().includes(word)))
  }, [opened, typed])
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
      items={matches.map(({ title, keys }) => ({ key: title, title, ...(keys ? { keys } : {}) }))}
      onPick={(index) => {
        // Executed after the list has closed and the focus has returned.
        setTimeout(() => matches[index]?.run())
      }}
    />
  )
}
