import { ActionIcon, Tooltip } from '@mantine/core'
import { IconAntennaBars5, IconPinned, IconPinnedOff, IconRoute, IconTag } from '@tabler/icons-react'
import { useStore } from '@xyflow/react'
import { useEffect, useMemo, useRef, useState } from 'react'
import { createPortal } from 'react-dom'
import type { WireEdgeType } from '../canvas/wire_edge'
import { nameSignal, shownName } from '../canvas/signal_names'
import { nameArea } from '../canvas/sheet_layout'
import { scheduleFrame, onFrame } from '../frames'
import type { Rectangle } from '../model/free_place'
import {
  fittedValue,
  labelWidth,
  placeLabels,
  type PlacedLabel,
  type ValueLabel,
} from '../model/value_labels'
import type { Lines, Point } from '../model/wire_lines'
import type { SheetPort, SheetBlock } from '../protocol'
import { samples } from '../samples'
import { formatNumber, displayUnit, useUnits } from '../scopes/quantity'
import { change, useStudio } from '../store'
import { shownTime } from './cursor'
import { useShownValues } from './shown_values'

const MAX_ELEMENTS = 4

/** The display text of a signal's value at a time in a width, px. */
function valueText(path: string, time: number, width: number): string {
  const signal = samples.signal(path)
  const index = samples.indexAt(time)
  if (!signal || index < 0) return ''
  const { channel, columns } = signal
  if (channel.shape.length > 1) return channel.shape.join(' × ')
  const values = columns.slice(0, MAX_ELEMENTS).map((column) => column[index] ?? NaN)
  const { factor, unit } = displayUnit(channel.unit, Math.max(...values.map(Math.abs)))
  const suffix = unit && ` ${unit}`
  const text = (digits: number, elements: number) => {
    const shown = values.slice(0, elements).map((value) => formatNumber(value * factor, digits))
    if (columns.length > elements) shown.push('…')
    return columns.length > 1 ? `[${shown.join(', ')}]${suffix}` : shown[0] + suffix
  }
  return fittedValue(text, width, values.length)
}

interface Output {
  ref: string
  block: SheetBlock
  port: SheetPort
}

function outputs(blocks: Record<string, SheetBlock>): Output[] {
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
export function WireValues({
  selectedEdge,
  lines,
}: {
  selectedEdge: WireEdgeType | undefined
  lines: Lines
}) {
  const blocks = useStudio((s) => s.document!.blocks)
  const logged = useStudio((s) => s.document!.logged)
  const pathPrefix = useStudio((s) => s.document!.inside.map((name) => `${name}/`).join(''))
  const views = useStudio((s) => s.run?.views)
  const hasRun = useStudio((s) => s.run !== null)
  const pinned = useShownValues((s) => s.pinned)
  const flow = useStore((s) => s.domNode)
  // Searched once, because React Flow's portal searches the whole sheet at every change.
  const portal = useMemo(() => flow?.querySelector('.react-flow__viewport-portal'), [flow])
  const zoom = useStore((s) => s.transform[2])
  const layer = useRef<HTMLDivElement>(null)
  const hovered = useHovered(flow)
  useValueTexts(layer)
  const outputPorts = outputs(blocks)
  const displays = (views ?? []).filter(
    ({ kind, block }) =>
      kind === 'value' && block.startsWith(pathPrefix) && blocks[block.slice(pathPrefix.length)],
  )
  const scale = Math.min(Math.max(1 / zoom, 1), 2.5)
  const labels = useLabels(hasRun ? outputPorts : [], blocks, hovered, pathPrefix, lines, scale)
  if (!portal) return null
  return createPortal(
    <div ref={layer} className="wire-values" style={{ '--label-scale': scale } as React.CSSProperties}>
      {labels.map(({ ref, style }) => (
        <span key={ref} className="wire-value numbers" data-path={pathPrefix + ref} style={style} />
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
/** Minimum width of a label, and maximum width of the label at the pointer, px. */
const MIN_LABEL_WIDTH = 24
const MAX_WIDTH = 400

/** The labels of the pinned values, or of all values, and of the value at the pointer. */
function useLabels(
  outputPorts: Output[],
  blocks: Record<string, SheetBlock>,
  hovered: string,
  pathPrefix: string,
  lines: Lines,
  scale: number,
): { ref: string; style: React.CSSProperties }[] {
  const { all, pinned } = useShownValues()
  const obstacles = useMemo(() => [...drawnBoxes(blocks), ...signalNames(lines)], [blocks, lines])
  const isKept = ({ ref }: Output) => all || pinned.has(pathPrefix + ref)
  const place = (shown: Output[], around: readonly Rectangle[]) =>
    placeLabels(
      shown.map((output) => labelOf(output, pathPrefix, lines)),
      { height: LABEL_HEIGHT * scale, scale },
      around,
    ).map((placed, k) => ({
      ref: shown[k]!.ref,
      style: labelStyle(placed, scale, shown[k]!.ref === hovered),
    }))
  const pointed = outputPorts.filter((output) => output.ref === hovered && !isKept(output))
  // The value at the pointer may cover others, and moves no other label.
  return [...place(outputPorts.filter(isKept), obstacles), ...place(pointed, [])]
}

/** The label of the value of an output. */
function labelOf({ ref, block, port }: Output, pathPrefix: string, lines: Lines): ValueLabel {
  const elements = samples.signal(pathPrefix + ref)?.columns.length ?? 1
  return {
    x: block.place.x + port.x,
    y: block.place.y + port.y,
    direction: port.dx < 0 ? -1 : 1,
    paths: Object.values(lines[ref]?.paths ?? {}),
    width: labelWidth(Math.min(elements, MAX_ELEMENTS)),
  }
}

/** Position and maximum width of a label; the label at the pointer is complete and above all others. */
function labelStyle(
  { x, top, direction, width }: PlacedLabel,
  scale: number,
  isPointed: boolean,
): React.CSSProperties {
  return {
    maxWidth: isPointed ? MAX_WIDTH : Math.max(width / scale, MIN_LABEL_WIDTH),
    transform: `${labelTransform(x, top)} translate(${direction < 0 ? '-100%' : '0'}, 0)`,
    ...(isPointed ? { zIndex: 1 } : {}),
  }
}

/** The rectangles of blocks and of their names. */
function drawnBoxes(blocks: Record<string, SheetBlock>): Rectangle[] {
  return Object.values(blocks).flatMap((block) => {
    const { place, width, height } = block
    return [{ x: place.x, y: place.y, width, height }, ...nameArea(block)]
  })
}

/** Width of a letter and height of the name of a signal, px. */
const NAME_LETTER = 6.5
const NAME_HEIGHT = 14

/** The rectangles of the names of signals on their lines. */
function signalNames(lines: Lines): Rectangle[] {
  return Object.values(lines).flatMap((net) => {
    const name = shownName(net)
    if (!name || !net.name_at) return []
    const [x, y, anchor] = net.name_at
    const width = NAME_LETTER * name.length
    const left = anchor === 'middle' ? x - width / 2 : x
    return [{ x: left, y: y - NAME_HEIGHT, width, height: NAME_HEIGHT }]
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
          element.textContent = valueText(path, time, width)
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
