import { ViewportPortal } from '@xyflow/react'
import { create } from 'zustand'
import { svgPath } from '../model/wire_lines'
import { useStudio } from '../store'
import { useBranch } from './branching'
import { useGuides } from './guides'

/** The blocks and notes that a drag duplicates, and their present displacement, px. */
export const useDraggedCopies = create<{ names: readonly string[]; shift: [number, number] }>(() => ({
  names: [],
  shift: [0, 0],
}))

export const clearCopies = (): void => useDraggedCopies.setState({ names: [] })

/** The preview of a drag: copies of blocks, or a branch of a wire; and the alignment of dragged blocks. */
export function DragPreview() {
  const { names, shift } = useDraggedCopies()
  const branch = useBranch((s) => s.branch)
  const guides = useGuides((s) => s.guides)
  const blocks = useStudio((s) => s.document!.blocks)
  const notes = useStudio((s) => s.document!.notes)
  if (!names.length && !branch && !guides.length) return null
  return (
    <ViewportPortal>
      {names.map((name) => {
        const block = blocks[name]
        const position = block?.place ?? notes[name]
        if (!position) return null
        const transform = `translate(${position.x + shift[0]}px, ${position.y + shift[1]}px)`
        return block ? (
          <svg
            key={name}
            className="face drawn-copy"
            width={block.width}
            height={block.height}
            style={{ transform }}
            aria-hidden
            dangerouslySetInnerHTML={{ __html: block.face }}
          />
        ) : (
          <div key={name} className="note drawn-copy" style={{ transform }} aria-hidden>
            {notes[name]!.text}
          </div>
        )
      })}
      {guides.length > 0 && (
        <svg className="guides" width="1" height="1" aria-hidden>
          {guides.map(({ axis, at: position, from, to }) => (
            <path key={axis} d={axis === 'x' ? `M${position} ${from}V${to}` : `M${from} ${position}H${to}`} />
          ))}
        </svg>
      )}
      {branch && (
        <svg className="drawn-branch" width="1" height="1" aria-hidden>
          <path d={svgPath(rightAnglePath(branch.from, branch.to))} />
          <circle cx={branch.from[0]} cy={branch.from[1]} r="3" />
        </svg>
      )}
    </ViewportPortal>
  )
}

/** A path of a vertical and then a horizontal segment. */
function rightAnglePath(
  [ax, ay]: readonly [number, number],
  [bx, by]: readonly [number, number],
): [number, number][] {
  return [
    [ax, ay],
    [ax, by],
    [bx, by],
  ]
}
