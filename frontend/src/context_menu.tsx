import './mantine_later.css'
import { Kbd, Menu } from '@mantine/core'
import { useEffect, useState } from 'react'
import { closeMenu, useContextMenu, type Entries, type Entry } from './context_menu_state'

/** A menu that is too long for the room below and above the pointer is moved until all of it is visible. */
const INSIDE_WINDOW = { shift: { crossAxis: true } }

/** The open context menu, at the pointer. */
export function ContextMenu() {
  const { opened, label, at, entries, openCount } = useContextMenu()
  // The menu closes when the window loses the focus.
  useEffect(() => {
    if (!opened) return
    addEventListener('blur', closeMenu)
    return () => removeEventListener('blur', closeMenu)
  }, [opened])
  return (
    <Menu
      key={openCount}
      opened={opened}
      onChange={(isOpen) => !isOpen && closeMenu()}
      position="bottom-start"
      offset={2}
      shadow="md"
      returnFocus={false}
      transitionProps={{ duration: 0 }}
      middlewares={INSIDE_WINDOW}
    >
      <Menu.Target>
        <div className="menu-anchor" style={{ left: at.x, top: at.y }} aria-hidden />
      </Menu.Target>
      <Menu.Dropdown aria-label={label} className={classOf(entries)}>
        <Items entries={entries} />
      </Menu.Dropdown>
    </Menu>
  )
}

/** If one entry has a check mark, all titles are indented in the same way, so that they are aligned. */
const classOf = (entries: Entries) =>
  entries.some((entry) => entry?.checked !== undefined) ? 'context-menu marked' : 'context-menu'

function Items({ entries }: { entries: Entries }) {
  return entries.map((entry, k) =>
    entry === null ? <Menu.Divider key={k} /> : <Item key={entry.title} entry={entry} />,
  )
}

function Item({ entry }: { entry: Entry }) {
  const { title, keys, enabled = true, checked, swatch, submenu, run } = entry
  if (submenu) return <Submenu title={title} entries={submenu} />
  if (checked !== undefined)
    return (
      <Menu.CheckboxItem
        checked={checked}
        disabled={!enabled}
        onChange={run}
        closeMenuOnClick
        rightSection={swatch && <span className="swatch" style={{ background: swatch }} />}
      >
        {title}
      </Menu.CheckboxItem>
    )
  return (
    <Menu.Item
      disabled={!enabled}
      rightSection={keys && <Kbd size="xs">{keys.split(', ')[0]}</Kbd>}
      onClick={run}
    >
      {title}
    </Menu.Item>
  )
}

function Submenu({ title, entries }: { title: string; entries: Entries }) {
  const [opened, setOpened] = useState(false)
  return (
    <Menu.Sub onChange={setOpened}>
      <Menu.Sub.Target>
        <Menu.Sub.Item>{title}</Menu.Sub.Item>
      </Menu.Sub.Target>
      <Menu.Sub.Dropdown className={classOf(entries)}>
        {opened && <Items entries={entries} />}
      </Menu.Sub.Dropdown>
    </Menu.Sub>
  )
}
