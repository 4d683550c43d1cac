import { ActionIcon, Tooltip } from '@mantine/core'
import {
  IconAngle,
  IconArrowsHorizontal,
  IconBolt,
  IconRulerMeasure,
  IconTableOptions,
  IconZoomIn,
  IconZoomOut,
} from '@tabler/icons-react'
import { useElementSize } from '@mantine/hooks'
import { useMemo } from 'react'
import { inNaturalOrder } from '../model/natural_order'
import { scopeGrid } from '../model/scope_grid'
import type { SinkView } from '../protocol'
import { shownTime } from '../run/cursor'
import { samples } from '../samples'
import { useStudio } from '../store'
import { Chart } from './chart'
import { useUnits } from './quantity'
import { tracesOf } from '../model/trace'
import { toggleTrigger, useTrigger } from './trigger'
import { TriggerBar } from './trigger_bar'
import { toggleCursors, useWindow, zoomBy } from './window'

/** All Scopes, XY Graphs and logged signals of the run, side by side. */
export function Scopes() {
  // Selected fields only: the progress of the run changes sixty times a second.
  const run = useStudio((s) => s.run?.run)
  const all = useStudio((s) => s.run?.views)
  const views = useMemo(() => {
    const shown = all?.filter(({ kind }) => kind === 'traces' || kind === 'path') ?? []
    return inNaturalOrder(shown, ({ title, block }) => title || block)
  }, [all])
  if (!run) return null
  if (!views.length)
    return (
      <p className="empty">
        The model has no Scope and no XY Graph, and no wire is logged: add a Scope, or click a wire and log
        it.
      </p>
    )
  return (
    <div className="scopes-panel">
      <PlotTools hasTrigger />
      <div className="scopes-beside-tools">
        <TriggerBar />
        <Grid count={views.length}>
          {views.map((view) => (
            <ScopeChart key={`${run}${view.block}${view.signals.join()}`} run={run} view={view} />
          ))}
        </Grid>
      </div>
    </div>
  )
}

/** Width of a chart with a table of measures, px. */
const MEASURED_WIDTH = 560

/** The charts in rows that fill the panel; the charts of an incomplete last row are wider. */
export function Grid({
  count,
  measuredWidth = MEASURED_WIDTH,
  children,
}: {
  count: number
  measuredWidth?: number
  children: React.ReactNode
}) {
  const { ref, width, height } = useElementSize()
  const measured = useWindow((s) => s.measuring || s.cursors !== null)
  const { columns, rowHeight } = scopeGrid(count, width, height, measured ? measuredWidth : undefined)
  const style = { '--columns': columns, '--row': `${Math.floor(rowHeight)}px` } as React.CSSProperties
  return (
    <div className="scopes" ref={ref} style={style}>
      {children}
    </div>
  )
}

function ScopeChart({ run, view }: { run: string; view: SinkView }) {
  const traces = useMemo(
    () =>
      tracesOf(
        samples,
        view.signals.map((name, k) => ({ path: `${view.block}/${name}`, label: view.labels[k] ?? '' })),
      ),
    // The samples of a run are one object while the run is displayed.
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [run, view],
  )
  return (
    <Chart title={view.title || view.block} traces={traces} isXy={view.kind === 'path'} view={view.block} />
  )
}

/** The tools for all time plots. */
export function PlotTools({ hasTrigger = false }: { hasTrigger?: boolean }) {
  const triggered = useTrigger((s) => s.on)
  const zoomed = useWindow((s) => s.range !== null)
  const cursors = useWindow((s) => s.cursors !== null)
  const measuring = useWindow((s) => s.measuring)
  const radians = useUnits((s) => s.radians)
  return (
    <div className="plot-tools" role="toolbar" aria-label="Plots" aria-orientation="vertical">
      <PlotTool
        label="Show the whole run"
        icon={IconArrowsHorizontal}
        disabled={!zoomed}
        onClick={() => useWindow.setState({ range: null })}
      />
      <PlotTool label="Zoom in (wheel)" icon={IconZoomIn} onClick={() => zoomBy(0.5, shownTime())} />
      <PlotTool
        label="Zoom out"
        icon={IconZoomOut}
        disabled={!zoomed}
        onClick={() => zoomBy(2, shownTime())}
      />
      <PlotTool label="Measuring cursors" icon={IconRulerMeasure} pressed={cursors} onClick={toggleCursors} />
      <PlotTool
        label="Measures of the visible range"
        icon={IconTableOptions}
        pressed={measuring}
        onClick={() => useWindow.setState({ measuring: !measuring })}
      />
      {!!hasTrigger && (
        <PlotTool label="Trigger" icon={IconBolt} pressed={triggered} onClick={toggleTrigger} />
      )}
      <PlotTool
        label={radians ? 'Angles in degrees' : 'Angles in radians'}
        icon={IconAngle}
        pressed={radians}
        onClick={() => useUnits.setState({ radians: !radians })}
      />
    </div>
  )
}

interface ToolProps {
  label: string
  icon: React.ComponentType<{ size: number }>
  disabled?: boolean
  pressed?: boolean
  onClick: () => void
}

function PlotTool({ label, icon: Icon, disabled = false, pressed, onClick }: ToolProps) {
  return (
    <Tooltip label={label} openDelay={400} position="right">
      <ActionIcon
        variant={pressed ? 'light' : 'subtle'}
        color={pressed ? 'accent' : 'gray'}
        size="sm"
        aria-label={label}
        aria-pressed={pressed}
        disabled={disabled}
        onClick={onClick}
      >
        <Icon size={15} />
      </ActionIcon>
    </Tooltip>
  )
}
