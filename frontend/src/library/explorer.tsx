import '../mantine_later.css'
import { Tree, useTree, type TreeNodeData } from '@mantine/core'
import { IconChevronRight, IconSitemap } from '@tabler/icons-react'
import { useEffect, useMemo, useState } from 'react'
import type { Outline } from '../protocol'
import { connection, openSheet, useStudio } from '../store'

const SEPARATOR = '/'

/** The subsystems of the model as a tree; a click opens the sheet. */
export function Explorer() {
  const document = useStudio((s) => s.document?.state.document)
  const version = useStudio((s) => s.document?.state.version)
  const title = useStudio((s) => s.document?.state.title ?? '')
  const inside = useStudio((s) => s.document?.inside)
  const [outline, setOutline] = useState<Outline | null>(null)
  const visiblePath = (inside ?? []).join(SEPARATOR)
  const tree = useTree({ initialExpandedState: { '': true } })
  useEffect(() => {
    if (!document) return
    let current = true
    connection.ask({ kind: 'outline', document }).then(
      (outline) => current && setOutline(outline),
      () => undefined,
    )
    return () => {
      current = false
    }
  }, [document, version])
  useEffect(() => {
    for (let depth = 0; depth <= (inside ?? []).length; depth++)
      tree.expand((inside ?? []).slice(0, depth).join(SEPARATOR))
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [visiblePath])
  const data = useMemo(() => (outline ? [node(outline, [], title)] : []), [outline, title])
  if (!outline) return <p className="empty">No model is open.</p>
  return (
    <div className="explorer">
      <Tree
        data={data}
        tree={tree}
        aria-label="Subsystems of the model"
        levelOffset={14}
        expandOnClick={false}
        renderNode={({
          node: { value, label, nodeProps },
          expanded,
          hasChildren,
          elementProps,
          tree: { toggleExpanded },
        }) => (
          <div
            {...elementProps}
            className={`${elementProps.className} branch${value === visiblePath ? ' here' : ''}`}
            onClick={() => openSheet(value ? value.split(SEPARATOR) : [])}
          >
            <IconChevronRight
              size={13}
              className={expanded ? 'turned' : ''}
              style={{ visibility: hasChildren ? 'visible' : 'hidden' }}
              onClick={(event) => {
                event.stopPropagation()
                toggleExpanded(value)
              }}
            />
            <IconSitemap size={14} />
            <span className="label">{label}</span>
            <span className="count">{nodeProps?.['count']}</span>
          </div>
        )}
      />
      {outline.subsystems.length === 0 && (
        <p className="empty">The model has one sheet. Ctrl+G puts the selected blocks into a subsystem.</p>
      )}
    </div>
  )
}

function node(outline: Outline, path: string[], label: string): TreeNodeData {
  return {
    value: path.join(SEPARATOR),
    label,
    nodeProps: { count: outline.blocks },
    children: outline.subsystems.map((inner) => node(inner, [...path, inner.name], inner.name)),
  }
}
