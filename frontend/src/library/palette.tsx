import { CloseButton, TextInput } from '@mantine/core'
import { IconChevronRight, IconSearch } from '@tabler/icons-react'
import { memo, useMemo, useState } from 'react'
import { BLOCK_TYPE } from '../canvas/insert'
import type { BlockType } from '../protocol'
import { useStudio } from '../store'
import { matching } from './search'

/** All blocks by family, filtered by the search text. Blocks are dragged to the sheet. */
export function Palette() {
  const library = useStudio((s) => s.welcome?.library)
  const [sought, setSought] = useState('')
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set(['sources', 'sinks']))
  const families = useMemo(() => {
    const found = sought ? matching(library ?? [], sought) : (library ?? [])
    const groups = new Map<string, BlockType[]>()
    for (const kind of found) groups.set(kind.family, [...(groups.get(kind.family) ?? []), kind])
    return [...groups]
  }, [library, sought])
  const toggle = (family: string) => {
    const next = new Set(open)
    if (!next.delete(family)) next.add(family)
    setOpen(next)
  }
  return (
    <div className="palette">
      <TextInput
        size="xs"
        aria-label="Search the library"
        placeholder="Search blocks"
        leftSection={<IconSearch size={14} />}
        rightSection={
          sought && <CloseButton size="xs" aria-label="Clear the search" onClick={() => setSought('')} />
        }
        value={sought}
        onChange={(event) => setSought(event.currentTarget.value)}
      />
      <div className="families">
        {families.length === 0 && sought && <p className="empty">No block matches “{sought}”.</p>}
        {families.map(([family, kinds]) => {
          const shown = sought !== '' || open.has(family)
          return (
            <section key={family}>
              <button type="button" className="family" aria-expanded={shown} onClick={() => toggle(family)}>
                <IconChevronRight size={13} className={shown ? 'turned' : ''} />
                {family}
                <span className="count">{kinds.length}</span>
              </button>
              {shown && (
                <div className="kinds">
                  {kinds.map((kind) => (
                    <Kind key={kind.type} kind={kind} />
                  ))}
                </div>
              )}
            </section>
          )
        })}
      </div>
    </div>
  )
}

const Kind = memo(function Kind({ kind }: { kind: BlockType }) {
  return (
    <div
      className="kind"
      draggable
      title={kind.summary}
      data-type={kind.type}
      onDragStart={(event) => {
        event.dataTransfer.setData(BLOCK_TYPE, kind.type)
        event.dataTransfer.effectAllowed = 'copy'
      }}
    >
      <Face kind={kind} />
      <span>{kind.title}</span>
    </div>
  )
})

export function Face({ kind }: { kind: BlockType }) {
  return (
    <svg
      className="face"
      viewBox={`-1 -1 ${kind.width + 2} ${kind.height + 2}`}
      aria-hidden
      dangerouslySetInnerHTML={{ __html: kind.face }}
    />
  )
}
