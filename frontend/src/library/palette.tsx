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
  const [query, setQuery] = useState('')
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set(['sources', 'sinks']))
  const families = useMemo(() => {
    const matches = query ? matching(library ?? [], query) : (library ?? [])
    const groups = new Map<string, BlockType[]>()
    for (const blockType of matches)
      groups.set(blockType.family, [...(groups.get(blockType.family) ?? []), blockType])
    return [...groups]
  }, [library, query])
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
          query && <CloseButton size="xs" aria-label="Clear the search" onClick={() => setQuery('')} />
        }
        value={query}
        onChange={(event) => setQuery(event.currentTarget.value)}
      />
      <div className="families">
        {families.length === 0 && query && <p className="empty">No block matches “{query}”.</p>}
        {families.map(([family, blockTypes]) => {
          const expanded = query !== '' || open.has(family)
          return (
            <section key={family}>
              <button
                type="button"
                className="family"
                aria-expanded={expanded}
                onClick={() => toggle(family)}
              >
                <IconChevronRight size={13} className={expanded ? 'turned' : ''} />
                {family}
                <span className="count">{blockTypes.length}</span>
              </button>
              {expanded && (
                <div className="kinds">
                  {blockTypes.map((blockType) => (
                    <PaletteEntry key={blockType.type} blockType={blockType} />
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

const PaletteEntry = memo(function PaletteEntry({ blockType }: { blockType: BlockType }) {
  return (
    <div
      className="kind"
      draggable
      title={blockType.summary}
      data-type={blockType.type}
      onDragStart={(event) => {
        event.dataTransfer.setData(BLOCK_TYPE, blockType.type)
        event.dataTransfer.effectAllowed = 'copy'
      }}
    >
      <Face blockType={blockType} />
      <span>{blockType.title}</span>
    </div>
  )
})

export function Face({ blockType }: { blockType: BlockType }) {
  return (
    <svg
      className="face"
      viewBox={`-1 -1 ${blockType.width + 2} ${blockType.height + 2}`}
      aria-hidden
      dangerouslySetInnerHTML={{ __html: blockType.face }}
    />
  )
}
