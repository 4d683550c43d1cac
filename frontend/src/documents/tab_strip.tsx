import './tab_strip.css'
import { ActionIcon, Tooltip } from '@mantine/core'
import { IconChevronDown, IconRobot, IconSchema, IconX } from '@tabler/icons-react'
import { useEffect, useRef, useState, type RefObject } from 'react'
import { openMenu, useMenuHandlers } from '../context_menu_state'
import { neighbour, tabAfter, tabLabels, type Tab } from '../model/tabs'
import { useRobotEditor } from '../robot/editor/state'
import { ask, useStudio } from '../store'
import { closeDocument, showTab, useTabs } from './tabs'

/** The tabs of the documents that are open in this client; they scroll if there is no room for all. */
export function TabStrip() {
  const tabs = useTabs((s) => s.tabs)
  const labels = tabLabels(tabs)
  const list = useRef<HTMLDivElement>(null)
  const overflows = useOverflow(list, tabs.length)
  const inFront = useDocumentInFront()
  useEffect(() => {
    if (list.current) showSelected(list.current)
  }, [inFront, tabs.length])
  return (
    <>
      <div
        className="tab-list"
        role="tablist"
        aria-label="Open documents"
        ref={list}
        onWheel={({ deltaX, deltaY }) => list.current?.scrollBy({ left: deltaX || deltaY })}
      >
        {tabs.map((tab, index) => (
          <DocumentTab
            key={tab.document}
            tab={tab}
            label={labels[index]!}
            inFront={tab.document === inFront}
          />
        ))}
      </div>
      {overflows && <AllTabs tabs={tabs} labels={labels} />}
    </>
  )
}

function useDocumentInFront(): string | undefined {
  const diagram = useStudio((s) => s.document?.state.document)
  return useRobotEditor((s) => s.current) ?? diagram
}

/** Scroll the tab of the visible document into the list. */
function showSelected(list: HTMLElement): void {
  list.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: 'nearest', inline: 'nearest' })
}

/** Whether the tabs are wider than their list. A change of the width scrolls the selected tab into view. */
function useOverflow(list: RefObject<HTMLDivElement | null>, count: number): boolean {
  const [overflows, setOverflows] = useState(false)
  useEffect(() => {
    const element = list.current
    if (!element) return
    const observer = new ResizeObserver(() => {
      setOverflows(element.scrollWidth > element.clientWidth + 1)
      showSelected(element)
    })
    observer.observe(element)
    if (element.lastElementChild) observer.observe(element.lastElementChild)
    return () => observer.disconnect()
  }, [list, count])
  return overflows
}

function useIsDirty(document: string): boolean {
  return useStudio((s) => s.documents.some((known) => known.document === document && known.dirty))
}

function DocumentTab({ tab, label, inFront }: { tab: Tab; label: string; inFront: boolean }) {
  const dirty = useIsDirty(tab.document)
  const menu = useMenuHandlers((at) =>
    openMenu(`Document ${label}`, at, menuEntries(tab, label, dirty, inFront)),
  )
  const Icon = tab.kind === 'robot' ? IconRobot : IconSchema
  return (
    <button
      type="button"
      role="tab"
      id={`tab-${tab.document}`}
      className="document-tab"
      aria-selected={inFront}
      aria-keyshortcuts="Delete"
      tabIndex={inFront ? 0 : -1}
      title={`${fileText(tab)}${dirty ? ', not saved' : ''}`}
      onClick={() => void showTab(tab)}
      onMouseDown={(event) => event.button === 1 && event.preventDefault()}
      onAuxClick={(event) => event.button === 1 && void closeDocument(tab.document)}
      onKeyDown={(event) => {
        if (handleKey(event.key, tab)) event.preventDefault()
      }}
      {...menu}
    >
      <Icon size={14} aria-hidden />
      <span className="label">{label}</span>
      {dirty && (
        <span className="dirty" role="img" aria-label="not saved">
          •
        </span>
      )}
      <span
        className="close"
        aria-hidden
        title={`Close ${label}${inFront ? ' (Alt+W)' : ''}`}
        onClick={(event) => {
          event.stopPropagation()
          void closeDocument(tab.document)
        }}
      >
        <IconX size={13} />
      </span>
    </button>
  )
}

const fileText = ({ path, origin }: Tab): string => path ?? (origin ? `a copy of ${origin}` : 'no file yet')

/** The keys of the tab list; the focus follows the shown tab. */
function handleKey(key: string, tab: Tab): boolean {
  const { tabs } = useTabs.getState()
  const targets: Record<string, Tab | undefined> = {
    ArrowLeft: tabAfter(tabs, tab.document, -1),
    ArrowRight: tabAfter(tabs, tab.document, 1),
    Home: tabs[0],
    End: tabs.at(-1),
  }
  const target = targets[key]
  if (target) void showTab(target).then(() => focusTab(target))
  else if (key === 'Delete') void closeByKey(tab)
  else return false
  return true
}

async function closeByKey({ document }: Tab): Promise<void> {
  const next = neighbour(useTabs.getState().tabs, document)
  await closeDocument(document)
  if (next && !useTabs.getState().closing) focusTab(next)
}

function focusTab({ document: key }: Tab): void {
  requestAnimationFrame(() => document.getElementById(`tab-${key}`)?.focus())
}

function menuEntries(tab: Tab, label: string, dirty: boolean, inFront: boolean) {
  const { documents } = useStudio.getState()
  const unsaved = new Set(documents.filter((known) => known.dirty).map(({ document }) => document))
  const others = useTabs
    .getState()
    .tabs.filter(({ document }) => document !== tab.document && !unsaved.has(document))
  return [
    {
      title: `Save ${label}`,
      enabled: dirty && tab.path !== null,
      run: () => void ask({ kind: 'save', document: tab.document }),
    },
    null,
    { title: 'Close', keys: inFront ? 'Alt+W' : undefined, run: () => void closeDocument(tab.document) },
    {
      title: 'Close the other saved documents',
      enabled: others.length > 0,
      run: () => void closeAll(others),
    },
  ]
}

async function closeAll(tabs: Tab[]): Promise<void> {
  for (const { document } of tabs) await closeDocument(document)
}

/** A menu of all tabs, shown at the end of the strip if the tabs are wider than the strip. */
function AllTabs({ tabs, labels }: { tabs: Tab[]; labels: string[] }) {
  const inFront = useDocumentInFront()
  return (
    <Tooltip label="All open documents" openDelay={400}>
      <ActionIcon
        variant="subtle"
        color="gray"
        size="sm"
        aria-label="All open documents"
        aria-haspopup="menu"
        onClick={({ currentTarget }) => {
          const { right, bottom } = currentTarget.getBoundingClientRect()
          openMenu(
            'All open documents',
            { x: right - 220, y: bottom },
            tabs.map((tab, index) => ({
              title: labels[index]!,
              checked: tab.document === inFront,
              run: () => void showTab(tab),
            })),
          )
        }}
      >
        <IconChevronDown size={15} />
      </ActionIcon>
    </Tooltip>
  )
}
