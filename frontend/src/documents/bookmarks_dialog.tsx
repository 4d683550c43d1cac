import './bookmarks_dialog.css'
import { ActionIcon, Button, Group, Menu, Modal, Text, TextInput } from '@mantine/core'
import { IconBookmark, IconDots } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import { showDialog, useDialogs } from '../dialogs'
import { bookmarkKey, preferredName } from '../model/bookmarks'
import type { SheetBookmark } from '../protocol'
import { freeName, useStudio } from '../store'
import { applyEdit, goTo, visiblePart } from './bookmarks'
import { useBookmarks } from './use_bookmarks'

/** Named views of the sheets, saved with the diagram: add, show, rename, update, remove. */
export function Bookmarks() {
  const opened = useDialogs((s) => s.open === 'bookmarks')
  const openCount = useDialogs((s) => s.openCount)
  return (
    <Modal
      opened={opened}
      onClose={() => showDialog(null)}
      closeButtonProps={{ 'aria-label': 'Close' }}
      title={<b>Bookmarks of views</b>}
      size={520}
    >
      {opened && <Content key={openCount} />}
    </Modal>
  )
}

function Content() {
  const bookmarks = useBookmarks(true)
  const adding = useDialogs((s) => s.typed === 'add')
  if (!bookmarks)
    return (
      <Text size="sm" tabIndex={-1} data-autofocus>
        Loading the bookmarks …
      </Text>
    )
  return (
    <>
      <AddForm bookmarks={bookmarks} focused={adding || !bookmarks.length} closes={adding} />
      {bookmarks.length > 0 && <List bookmarks={bookmarks} focused={!adding} />}
    </>
  )
}

/** The form that adds a bookmark of the present view; a name is proposed. */
function AddForm({
  bookmarks,
  focused,
  closes,
}: {
  bookmarks: SheetBookmark[]
  focused: boolean
  closes: boolean
}) {
  const { inside, state, linked } = useStudio.getState().document!
  const ofSheet = bookmarks.filter((bookmark) => bookmark.inside.join('/') === inside.join('/'))
  const preferred = preferredName(useStudio.getState().selection, inside.at(-1) ?? state.title)
  const proposed = freeName(
    preferred,
    ofSheet.map(({ name }) => name),
  )
  const [typed, setTyped] = useState<string | null>(null)
  const field = useRef<HTMLInputElement>(null)
  useEffect(() => {
    if (focused) field.current?.select()
  }, [focused])
  const name = (typed ?? proposed).trim()
  const part = visiblePart()
  const obstacle = linked.length
    ? 'This sheet belongs to a library. Break its link to add bookmarks.'
    : part
      ? ''
      : 'The sheet is not visible.'
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        if (!name || !part || obstacle) return
        void applyEdit({ kind: 'add_bookmark', name, part }, inside).then((done) => {
          if (!done) return
          setTyped(null)
          if (closes) showDialog(null)
        })
      }}
    >
      <Group gap="xs" align="end" wrap="nowrap">
        <TextInput
          ref={field}
          label="Name of the present view"
          size="sm"
          flex={1}
          value={typed ?? proposed}
          maxLength={200}
          disabled={obstacle !== ''}
          onChange={(event) => setTyped(event.currentTarget.value)}
        />
        <Button type="submit" size="sm" disabled={!name || obstacle !== ''}>
          Add bookmark
        </Button>
      </Group>
      <Text size="xs" c="dimmed" mt={6}>
        {obstacle || 'The bookmark stores the sheet and its visible part, and is saved with the diagram.'}
      </Text>
    </form>
  )
}

/** The index in the list to which a key moves the focus. */
const MOVES: Record<string, (index: number, last: number) => number> = {
  ArrowDown: (index, last) => Math.min(index + 1, last),
  ArrowUp: (index) => Math.max(index - 1, 0),
  Home: () => 0,
  End: (_, last) => last,
}

/** All bookmarks; the arrow keys move through the list. */
function List({ bookmarks, focused }: { bookmarks: SheetBookmark[]; focused: boolean }) {
  const [renaming, setRenaming] = useState('')
  const [index, setIndex] = useState(0)
  const list = useRef<HTMLUListElement>(null)
  const active = Math.min(index, bookmarks.length - 1)
  const focus = (next: number) => {
    setIndex(next)
    list.current?.querySelectorAll<HTMLElement>('.show')[next]?.focus()
  }
  useEffect(() => {
    if (focused) list.current?.querySelector<HTMLElement>('.show')?.focus()
  }, [focused])
  const remove = (bookmark: SheetBookmark) =>
    void applyEdit({ kind: 'remove_bookmark', name: bookmark.name }, bookmark.inside)
  // After a removal the next bookmark has the focus, after a renaming the renamed bookmark.
  const hadFocus = useRef(false)
  useEffect(() => {
    if (hadFocus.current && document.activeElement === document.body) focus(active)
  })
  return (
    <ul
      className="bookmarks"
      aria-label="Bookmarks"
      ref={list}
      onFocus={() => {
        hadFocus.current = true
      }}
      onKeyDown={(event) => {
        const bookmark = bookmarks[active]
        if (!bookmark || !(event.target instanceof HTMLButtonElement)) return
        const move = MOVES[event.key]
        if (move) focus(move(active, bookmarks.length - 1))
        else if (event.key === 'F2' && !bookmark.linked) setRenaming(bookmarkKey(bookmark))
        else if (event.key === 'Delete' && !bookmark.linked) remove(bookmark)
        else return
        event.preventDefault()
      }}
    >
      {bookmarks.map((bookmark, position) => (
        <li key={bookmarkKey(bookmark)} onFocus={() => setIndex(position)}>
          {renaming === bookmarkKey(bookmark) ? (
            <NewName bookmark={bookmark} onClose={() => setRenaming('')} />
          ) : (
            <>
              <ShowButton bookmark={bookmark} reachable={position === active} />
              <Commands
                bookmark={bookmark}
                rename={() => setRenaming(bookmarkKey(bookmark))}
                remove={() => remove(bookmark)}
              />
            </>
          )}
        </li>
      ))}
    </ul>
  )
}

/** The name and the sheet of a bookmark; a click shows its view. */
function ShowButton({ bookmark, reachable }: { bookmark: SheetBookmark; reachable: boolean }) {
  const title = useStudio((s) => s.document?.state.title ?? '')
  return (
    <button
      type="button"
      className="show"
      title={bookmark.name}
      tabIndex={reachable ? 0 : -1}
      onClick={() => {
        showDialog(null)
        void goTo(bookmark)
      }}
    >
      <IconBookmark size={15} aria-hidden />
      <b>{bookmark.name}</b>
      <small>{[title, ...bookmark.inside].join(' › ')}</small>
    </button>
  )
}

interface CommandProps {
  bookmark: SheetBookmark
  rename: () => void
  remove: () => void
}

function Commands({ bookmark, rename, remove }: CommandProps) {
  const { name, inside, linked } = bookmark
  const isShown = useStudio((s) => s.document?.inside.join('/') === inside.join('/'))
  const part = visiblePart()
  return (
    <Menu position="bottom-end" shadow="md">
      <Menu.Target>
        <ActionIcon size="sm" variant="subtle" color="gray" aria-label={`Commands for ${name}`}>
          <IconDots size={14} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown className="context-menu">
        <Menu.Item
          disabled={linked || !isShown || !part}
          title={isShown ? '' : 'The sheet of the bookmark is not shown.'}
          onClick={() => part && void applyEdit({ kind: 'add_bookmark', name, part, replace: true }, inside)}
        >
          Update to the present view
        </Menu.Item>
        <Menu.Item disabled={linked} onClick={rename}>
          Rename
        </Menu.Item>
        <Menu.Divider />
        <Menu.Item disabled={linked} onClick={remove}>
          Remove
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  )
}

function NewName({ bookmark: { name, inside }, onClose }: { bookmark: SheetBookmark; onClose: () => void }) {
  const [typed, setTyped] = useState(name)
  const accept = () => {
    const to = typed.trim()
    if (!to || to === name) onClose()
    else void applyEdit({ kind: 'rename_bookmark', name, to }, inside).then((done) => done && onClose())
  }
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault()
        accept()
      }}
    >
      <TextInput
        size="xs"
        autoFocus
        maxLength={200}
        aria-label={`New name of ${name}`}
        data-mantine-stop-propagation // Escape closes the field, not the dialog
        value={typed}
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setTyped(event.currentTarget.value)}
        onBlur={onClose}
        onKeyDown={(event) => {
          if (event.key !== 'Escape') return
          event.stopPropagation()
          onClose()
        }}
      />
    </form>
  )
}
