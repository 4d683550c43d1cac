import { useEffect, useMemo } from 'react'
import { create } from 'zustand'
import { commands } from './commands'
import { openFind } from './library/find'
import { PickList } from './library/pick_list'

const usePalette = create<{ opened: boolean; typed: string }>(() => ({ opened: false, typed: '' }))

/** All that can be done, by its name: Ctrl+K. Find is beside it, Ctrl+F. */
export function CommandPalette() {
  const { opened, typed } = usePalette()
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (!(event.ctrlKey || event.metaKey) || event.shiftKey) return
      const key = event.key.toLowerCase()
      if (key === 'k') usePalette.setState({ opened: true, typed: '' })
      else if (key === 'f') openFind()
      else return
      event.preventDefault()
    }
    addEventListener('keydown', onKey)
    return () => removeEventListener('keydown', onKey)
  }, [])
  const found = useMemo(() => {
    const words = typed.toLowerCase().split(/\s+/).filter(Boolean)
    const possible = opened ? commands().filter(({ possible }) => possible?.() ?? true) : []
    return possible.filter(({ title }) => words.every((word) => title.toLowerCase().includes(word)))
  }, [opened, typed])
  return (
    <PickList
      opened={opened}
      onClose={() => usePalette.setState({ opened: false })}
      label="Command"
      placeholder="What do you want to do?"
      list="Commands"
      typed={typed}
      onTyped={(next) => usePalette.setState({ typed: next })}
      nothing={`No command matches “${typed}”. Blocks are added by typing their name on the sheet.`}
      items={found.map(({ title, keys }) => ({ key: title, title, ...(keys ? { keys } : {}) }))}
      onPick={(index) => {
        // When the list has closed and the focus is back.
        setTimeout(() => found[index]?.run())
      }}
    />
  )
}
