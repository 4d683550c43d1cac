import { ActionIcon, Tooltip } from '@mantine/core'
import { IconAntennaBars5, IconPinned, IconPinnedOff, IconRoute, IconTag } from '@tabler/icons-react'
import { useStore } from '@xyflow/react'
import { useEffect, useMemo, useRef, useState } from 'react'
import { createPortal } from 'react-dom'
import type { Point } from '../model/wire_lines'
import type { WireEdgeType } from '../canvas/wire_edge'
import { nameSignal } from '../canvas/signal_names'
import { nameArea } from '../canvas/sheet_layout'
import { scheduleFrame, onFrame } from '../frames'
import type { Rectangle } from '../model/free_place'
import { fittedValue, labelPosition, WIRE_DISTANCE } from '../model/value_labels'
import type { SheetPort, SheetBlock } from '../protocol'
import { samples } from '../samples'
import { formatNumber, displayUnit, useUnits } from '../scopes/quantity'
import { change, useStudio } from '../store'
import { shownTime } from './cursor'
import { useShownValues } from './shown_values'

const MAX_ELEMENTS = 4

/** The display text of a signal's value at a time. */
function valueAtTime(path: string, time: number, digits: number): string {
  const signal = samples.signal(path)
  const index = samples.indexAt(time)
  if (!signal || index < 0) return ''
  const { channel, columns } = signal
  if (channel.shape.length > 1) return channel.shape.join(' × ')
  const values = columns.slice(0, MAX_ELEMENTS).map((column) => column[index] ?? NaN)
  const { factor, unit } = displayUnit(channel.unit, Math.max(...values.map(Math.abs)))
  const shown = values.map((value) => formatNumber(value * factor, digits)).join(', ')
  const ellipsis = columns.length > MAX_ELEMENTS ? ', …' : ''
  return `${columns.length > 1 ? `[${shown}${ellipsis}]` : shown}${unit && ` ${unit}`}`
}

function outputs(blocks: Record<string, SheetBlock>): { ref: string; block: SheetBlock; port: SheetPort }[] {
  return Object.values(blocks).flatMap((block) =>
    block.outputs
      .filter(({ frame }) => !frame)
      .map((port) => ({ ref: `${block.name}/${port.name}`, block, port })),
  )
}

/**
 * Values on the wires, marks of logged signals, and the tools of the selected wire, drawn on the
 * sheet itself.
 */
export function WireValues({ selectedEdge }: { selectedEdge: WireEdgeType | undefined }) {
  const blocks = useStudio((s) => s.document!.blocks)
  const logged = useStudio((s) => s.document!.logged)
  const pathPrefix = useStudio((s) => s.document!.inside.map((name) => `${name}/`).join(''))
  const views = useStudio((s) => s.run?.views)
  const hasRun = useStudio((s) => s.run !== null)
  const { all, pinned } = useShownValues()
  const flow = useStore((s) => s.domNode)
  // Searched once, because React Flow's portal searches the whole sheet at every change.
  const portal = useMemo(() => flow?.querySelector('.react-flow__viewport-portal'), [flow])
  const zoom = useStore((s) => s.transform[2])
  const layer = useRef<HTMLDivElement>(null)
  const hovered = useHovered(flow)
  useValueTexts(layer)
  const outputPorts = outputs(blocks)
  const shown = hasRun
    ? outputPorts.filter(({ ref }) => all || ref === hovered || pinned.has(pathPrefix + ref))
    : []
  const displays = (views ?? []).filter(
    ({ kind, block }) =>
      kind === 'value' && block.startsWith(pathPrefix) && blocks[block.slice(pathPrefix.length)],
  )
  const obstacles = useMemo(() => (hasRun ? drawnBoxes(blocks) : []), [hasRun, blocks])
  const scale = Math.min(Math.max(1 / zoom, 1), 2.5)
  if (!portal) return null
  return createPortal(
    <div ref={layer} className="wire-values" style={{ '--label-scale': scale } as React.CSSProperties}>
      {shown.map((output) => (
        <span
          key={output.ref}
          className="wire-value numbers"
          data-path={pathPrefix + output.ref}
          style={labelStyle(output, output.ref === hovered ? [] : obstacles, scale)}
        />
      ))}
      {displays.flatMap(({ block: path, signals }) => {
        const block = blocks[path.slice(pathPrefix.length)]!
        return block.inputs
          .filter(({ name }) => signals.includes(name))
          .map((port) => (
            <span
              key={`${path}/${port.name}`}
              className="display-value numbers"
              data-path={`${path}/${port.name}`}
              style={{
                width: block.width - 12,
                transform: `translate(${block.place.x + 6}px, ${block.place.y + port.y}px) translateY(-50%)`,
              }}
            />
          ))
      })}
      {outputPorts
        .filter(({ ref }) => logged.includes(ref))
        .map(({ ref, block, port }) => (
          <span
            key={ref}
            className="logged-badge"
            title={`${ref} is logged`}
            style={{
              transform: labelTransform(
                block.place.x + port.x + (port.dx < 0 ? -16 : 4),
                block.place.y + port.y + 3,
              ),
            }}
          >
            <IconAntennaBars5 size={12} aria-label={`${ref} is logged`} />
          </span>
        ))}
      {selectedEdge && !selectedEdge.data?.frame && (
        <WireTools edge={selectedEdge} pathPrefix={pathPrefix} logged={logged} pinned={pinned} />
      )}
    </div>,
    portal,
  )
}

/** Height of a label, px. */
const LABEL_HEIGHT = 14
/** Minimum width of a label, px. */
const MIN_LABEL_WIDTH = 24

/** Position and maximum width of the value at an output. */
function labelStyle(
  { block, port }: ReturnType<typeof outputs>[number],
  obstacles: readonly Rectangle[],
  scale: number,
): React.CSSProperties {
  const direction = port.dx < 0 ? -1 : 1
  const [x, y] = [block.place.x + port.x + 6 * direction, block.place.y + port.y]
  const { below, width } = labelPosition(
    { x, y },
    direction,
    { height: LABEL_HEIGHT * scale, scale },
    obstacles,
  )
  const shift = `translate(${direction < 0 ? '-100%' : '0'}, ${below ? '0' : '-100%'})`
  return {
    maxWidth: Math.max(width / scale, MIN_LABEL_WIDTH),
    transform: `${labelTransform(x, below ? y + WIRE_DISTANCE : y - WIRE_DISTANCE)} ${shift}`,
  }
}

/** The rectangles of blocks and of their names. */
function drawnBoxes(blocks: Record<string, SheetBlock>): Rectangle[] {
  return Object.values(blocks).flatMap((block) => {
    const { place, width, height } = block
    return [{ x: place.x, y: place.y, width, height }, ...nameArea(block)]
  })
}

/** Write the displayed values into their elements, in the frame after a change and without React. */
function useValueTexts(layer: React.RefObject<HTMLDivElement | null>): void {
  useEffect(scheduleFrame) // the elements may have changed
  useEffect(
    () =>
      onFrame(() => {
        const time = shownTime()
        layer.current?.querySelectorAll<HTMLElement>('[data-path]').forEach((element) => {
          const { path = '', written } = element.dataset
          const width = Number.parseFloat(element.style.maxWidth || element.style.width)
          const state = `${samples.version} ${time} ${path} ${useUnits.getState().radians} ${width}`
          if (written === state) return
          element.dataset['written'] = state
          element.textContent = fittedValue((digits) => valueAtTime(path, time, digits), width)
        })
      }),
    [layer],
  )
}

function WireTools({
  edge,
  pathPrefix,
  logged,
  pinned,
}: {
  edge: WireEdgeType
  pathPrefix: string
  logged: string[]
  pinned: ReadonlySet<string>
}) {
  const ref = `${edge.source}/${edge.sourceHandle}`
  const path = edge.data?.path ?? []
  const longest = path.slice(1).reduce((best, _, k) => (length(path, k) > length(path, best) ? k : best), 0)
  const [from, to] = [path[longest], path[longest + 1]]
  if (!from || !to) return null
  const isLogged = logged.includes(ref)
  const isPinned = pinned.has(pathPrefix + ref)
  return (
    <div
      className="wire-tools nodrag nopan"
      role="toolbar"
      aria-label={`Wire from ${ref}`}
      style={{
        transform:
          labelTransform((from[0] + to[0]) / 2, (from[1] + to[1]) / 2 - 6) + ' translate(-50%, -100%)',
      }}
    >
      <Tooltip label={isLogged ? 'Do not log this signal' : 'Log this signal in a separate scope'}>
        <ActionIcon
          size="sm"
          variant={isLogged ? 'light' : 'subtle'}
          color={isLogged ? 'accent' : 'gray'}
          aria-label={isLogged ? 'Stop logging' : 'Log'}
          aria-pressed={isLogged}
          onClick={() => void change({ kind: 'log', port: ref, logged: !isLogged })}
        >
          <IconAntennaBars5 size={15} />
        </ActionIcon>
      </Tooltip>
      <Tooltip label={isPinned ? 'Remove the value from the sheet' : 'Keep the value on the sheet'}>
        <ActionIcon
          size="sm"
          variant={isPinned ? 'light' : 'subtle'}
          color={isPinned ? 'accent' : 'gray'}
          aria-label={isPinned ? 'Unpin the value' : 'Pin the value'}
          aria-pressed={isPinned}
          onClick={() =>
            useShownValues.setState((s) => {
              const next = new Set(s.pinned)
              if (!next.delete(pathPrefix + ref)) next.add(pathPrefix + ref)
              return { pinned: next }
            })
          }
        >
          {isPinned ? <IconPinnedOff size={15} /> : <IconPinned size={15} />}
        </ActionIcon>
      </Tooltip>
      <NameTool port={ref} />
      {edge.data?.bent && (
        <Tooltip label="Reset to automatic routing">
          <ActionIcon
            size="sm"
            variant="subtle"
            color="gray"
            aria-label="Reset the route"
            onClick={() =>
              void change({
                kind: 'bend',
                wires: [{ source: ref, target: `${edge.target}/${edge.targetHandle}` }],
              })
            }
          >
            <IconRoute size={15} />
          </ActionIcon>
        </Tooltip>
      )}
    </div>
  )
}

function NameTool({ port }: { port: string }) {
  return (
    <Tooltip label="Name the signal (double click on the wire)">
      <ActionIcon
        size="sm"
        variant="subtle"
        color="gray"
        aria-label="Name the signal"
        onClick={() => nameSignal(port)}
      >
        <IconTag size={15} />
      </ActionIcon>
    </Tooltip>
  )
}

const length = (path: readonly Point[], k: number) =>
  path[k + 1] ? Math.abs(path[k + 1]![0] - path[k]![0]) + Math.abs(path[k + 1]![1] - path[k]![1]) : 0

/** The output of the wire under the pointer; empty if there is none. */
function useHovered(flow: HTMLElement | null): string {
  const [hovered, setHovered] = useState('')
  useEffect(() => {
    if (!flow) return
    const onPointerOver = ({ target }: Event) => {
      const id = (target as Element).closest('.react-flow__edge')?.getAttribute('data-id')
      setHovered(id ? id.slice(0, id.indexOf(' -> ')) : '')
    }
    flow.addEventListener('pointerover', onPointerOver)
    return () => flow.removeEventListener('pointerover', onPointerOver)
  }, [flow])
  return hovered
}

/** The CSS transform of a label at a position of the sheet (px), with a readable size at every zoom. */
function labelTransform(x: number, y: number): string {
  return `translate(${x}px, ${y}px) scale(var(--label-scale))`
}
