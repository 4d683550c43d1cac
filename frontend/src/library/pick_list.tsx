import './pick_list.css'
import { Kbd, Modal, TextInput } from '@mantine/core'
import { useEffect, useRef, useState, type ReactNode } from 'react'
import { useDialogs } from '../dialogs'

export interface PickItem {
  key: string
  title: string
  /** The heading of consecutive entries; without one, entries have no heading. */
  group?: string
  note?: string
  face?: ReactNode
  keys?: string
}

interface PickListProps {
  opened: boolean
  onClose: () => void
  label: string
  placeholder: string
  /** The label of the list. */
  list: string
  typed: string
  onTyped: (typed: string) => void
  items: PickItem[]
  emptyText: string
  onPick: (index: number) => void
}

/** A search list: type a few letters, select with the arrow keys, press Enter. */
export function PickList({
  opened,
  onClose,
  label,
  placeholder,
  list,
  typed,
  onTyped,
  items,
  emptyText,
  onPick,
}: PickListProps) {
  const [activeIndex, setActiveIndex] = useState(0)
  const listElement = useRef<HTMLDivElement>(null)
  useEffect(() => setActiveIndex(0), [typed, opened])
  useEffect(() => {
    // The effect returns nothing: in new browsers the result of the call is a promise.
    listElement.current?.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: 'nearest' })
  }, [activeIndex])
  const pick = (index: number) => {
    if (!items[index]) return
    onClose()
    onPick(index)
  }
  usePickEarly(opened && items.length > 0, () => pick(0))
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      withCloseButton={false}
      size="md"
      padding="xs"
      yOffset="16vh"
      classNames={{ content: 'pick-list' }}
      attributes={{ content: { 'aria-label': label } }}
    >
      <TextInput
        aria-label={label}
        placeholder={placeholder}
        data-autofocus
        value={typed}
        onChange={(event) => {
          useDialogs.setState({ accepted: false })
          onTyped(event.currentTarget.value)
        }}
        onKeyDown={(event) => {
          if (event.key === 'ArrowDown') setActiveIndex(Math.min(activeIndex + 1, items.length - 1))
          else if (event.key === 'ArrowUp') setActiveIndex(Math.max(activeIndex - 1, 0))
          else if (event.key === 'Enter') pick(activeIndex)
          else return
          event.preventDefault()
        }}
      />
      <div role="listbox" aria-label={list} className="found" ref={listElement}>
        {groupsOf(items).map(({ group, first, members }) => {
          const options = members.map((item, index) => (
            <Option
              key={item.key}
              item={item}
              active={first + index === activeIndex}
              activate={() => setActiveIndex(first + index)}
              pick={() => pick(first + index)}
            />
          ))
          return group ? (
            <div role="group" aria-label={group} key={first} className="group">
              <div className="heading" aria-hidden>
                {group}
              </div>
              {options}
            </div>
          ) : (
            options
          )
        })}
      </div>
      {items.length === 0 && <p className="empty">{emptyText}</p>}
    </Modal>
  )
}

/** Pick the first entry as soon as there is one, if Enter was pressed before the field had the focus. */
function usePickEarly(available: boolean, pickFirst: () => void): void {
  const accepted = useDialogs((s) => s.accepted)
  useEffect(() => {
    if (!available || !accepted) return
    useDialogs.setState({ accepted: false })
    pickFirst()
  })
}

/** Consecutive entries with the same heading; `first` is the index of the first one. */
function groupsOf(items: PickItem[]) {
  const groups: { group: string; first: number; members: PickItem[] }[] = []
  for (const [index, item] of items.entries()) {
    const last = groups.at(-1)
    if (last?.group === (item.group ?? '')) last.members.push(item)
    else groups.push({ group: item.group ?? '', first: index, members: [item] })
  }
  return groups
}

interface OptionProps {
  item: PickItem
  active: boolean
  activate: () => void
  pick: () => void
}

function Option({ item: { title, note, face, keys }, active, activate, pick }: OptionProps) {
  return (
    <button
      type="button"
      role="option"
      aria-selected={active}
      tabIndex={-1}
      onClick={pick}
      onMouseMove={({ movementX, movementY }) => {
        // Browsers also report a move when the list changes under a resting pointer.
        if (movementX || movementY) activate()
      }}
    >
      {face}
      <span className="what">
        <b>{title}</b>
        {note && <small>{note}</small>}
      </span>
      {keys && <Kbd size="xs">{keys}</Kbd>}
    </button>
  )
}
