import { ActionIcon, Menu } from '@mantine/core'
import { IconArrowsVertical, IconAspectRatio, IconDownload } from '@tabler/icons-react'
import { useRef, useState } from 'react'
import { useMenuHandlers, openMenu, type Entries } from '../context_menu_state'
import { useRuns } from '../run/runs'
import { showBlock, useStudio } from '../store'
import { saveCsv, savePng, saveSvg } from './export'
import type { Figure } from './figure'
import { Legend } from './legend'
import { MeasureTable } from './measure_table'
import { Plot, type PlotHandle } from './plot'
import type { Values } from './plot_gestures'
import { useUnits } from './quantity'
import type { Trace } from '../model/trace'
import { toggleTrigger, useTrigger } from './trigger'
import { toggleCursors, useWindow, visibleTimes } from './window'
import { equalAxes, XyPlot } from './xy_plot'
import './chart.css'

/** Hidden traces and the visible range of values, which two charts may share. */
export interface ChartState {
  hidden: ReadonlySet<string>
  toggle: (key: string) => void
  values: Values | null
  setValues: (values: Values | null) => void
}

export function useChartState(): ChartState {
  const [hidden, setHidden] = useState<ReadonlySet<string>>(new Set())
  const [values, setValues] = useState<Values | null>(null)
  const toggle = (key: string) =>
    setHidden((previous) => {
      const next = new Set(previous)
      if (!next.delete(key)) next.add(key)
      return next
    })
  return { hidden, toggle, values, setValues }
}

/** A plot with its title, legend (a click hides a trace), export menu and table of measures. */
export function Chart({
  title,
  traces,
  isXy = false,
  view,
  band,
  shared,
  companions,
}: {
  title: string
  traces: Trace[]
  isXy?: boolean
  /** The block whose signals are shown. */
  view?: string
  band?: number
  /** The state of this chart, and state and traces of another chart with equal axes. */
  shared?: ChartState
  companions?: Trace[]
}) {
  const own = useChartState()
  const { hidden, toggle, values, setValues } = shared ?? own
  const hasMeasures = useWindow((s) => s.measuring || s.cursors !== null) && !isXy
  const handle = useRef<PlotHandle>(null)
  const { axesMayBeEqual, equal, setEqual } = useEqualAxes(traces)
  const exports = () =>
    exportEntries(
      title,
      traces,
      traces.filter(({ key }) => !hidden.has(key)),
      isXy,
      () => handle.current?.figure(),
    )
  const menus = useMenuHandlers((at) =>
    openMenu(title, at, [
      ...(isXy
        ? [{ title: 'Equal axes', checked: equal, enabled: axesMayBeEqual, run: () => setEqual(!equal) }]
        : [{ title: 'Show all values', enabled: values !== null, run: () => setValues(null) }]),
      ...(isXy ? [] : [...plotEntries(), ...traceEntries(traces, hidden, toggle)]),
      ...(view ? blockEntry(view) : []),
      null,
      ...exports(),
    ]),
  )
  return (
    <figure className={hasMeasures ? 'chart measured' : 'chart'} data-view={view} {...menus}>
      <figcaption>
        <b title={title}>{title}</b>
        {isXy ? <span className="legend" /> : <Legend traces={traces} hidden={hidden} toggle={toggle} />}
        {values && <ShowAllValues title={title} show={() => setValues(null)} />}
        {isXy && axesMayBeEqual && <EqualAxes equal={equal} title={title} set={setEqual} />}
        <Exports title={title} entries={exports} />
      </figcaption>
      <div className="with-measures">
        {isXy ? (
          <XyPlot traces={traces} title={title} equal={equal} handle={handle} />
        ) : (
          <Plot
            traces={traces}
            hidden={hidden}
            title={title}
            handle={handle}
            values={values}
            onValues={setValues}
            {...(band === undefined ? {} : { band })}
            {...(companions ? { companions } : {})}
          />
        )}
        {hasMeasures && <MeasureTable traces={traces.filter(({ key }) => !hidden.has(key))} />}
      </div>
    </figure>
  )
}

/** The button that shows all values after a zoom of the value axis. */
function ShowAllValues({ title, show }: { title: string; show: () => void }) {
  return (
    <ActionIcon
      className="all-values"
      variant="light"
      color="accent"
      size="xs"
      aria-label={`Show all values of ${title}`}
      title="Show all values"
      onClick={show}
    >
      <IconArrowsVertical size={13} />
    </ActionIcon>
  )
}

/** Whether both axes of an XY graph have the same scale: initially, if the signals have the same unit. */
function useEqualAxes(traces: Trace[]) {
  const { possible, initial } = equalAxes(traces)
  const [chosen, setEqual] = useState<boolean | null>(null)
  return { axesMayBeEqual: possible, equal: possible && (chosen ?? initial), setEqual }
}

/** The button that gives both axes of an XY graph the same scale. */
function EqualAxes({ equal, title, set }: { equal: boolean; title: string; set: (equal: boolean) => void }) {
  return (
    <ActionIcon
      className="all-values"
      variant={equal ? 'light' : 'subtle'}
      color={equal ? 'accent' : 'gray'}
      size="xs"
      aria-label={`Equal axes of ${title}`}
      aria-pressed={equal}
      title={equal ? 'Fill the panel' : 'Same scale for both axes'}
      onClick={() => set(!equal)}
    >
      <IconAspectRatio size={13} />
    </ActionIcon>
  )
}

function Exports({ title, entries }: { title: string; entries: () => Action[] }) {
  useWindow((s) => s.range !== null)
  return (
    <Menu position="bottom-end" shadow="md">
      <Menu.Target>
        <ActionIcon className="more" variant="subtle" color="gray" size="xs" aria-label={`Export ${title}`}>
          <IconDownload size={13} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        {entries().map(({ title: entryTitle, run }) => (
          <Menu.Item key={entryTitle} onClick={run}>
            {entryTitle}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  )
}

interface Action {
  title: string
  run: () => void
}

/** The ways to save a chart: all samples, the shown samples, and the shown picture. */
function exportEntries(
  title: string,
  traces: Trace[],
  shown: Trace[],
  isXy: boolean,
  figure: () => Figure | undefined,
): Action[] {
  const stride = useRuns.getState().runs.at(-1)?.stride ?? 1
  const withFigure = (save: (figure: Figure) => void) => () => {
    const now = figure()
    if (now) save(now)
  }
  const samplesText = stride > 1 ? `extremes of every ${stride} samples` : 'samples'
  const capitalised = samplesText.charAt(0).toUpperCase() + samplesText.slice(1)
  const isPart = !isXy && (useWindow.getState().range !== null || shown.length < traces.length)
  return [
    { title: `${capitalised} as CSV`, run: () => saveCsv(title, traces) },
    ...(isPart
      ? [
          {
            title: `Shown ${samplesText} as CSV`,
            run: () => saveCsv(title, shown, visibleTimes()),
          },
        ]
      : []),
    { title: 'Picture as PNG', run: withFigure((now) => void savePng(now)) },
    { title: 'Picture as SVG', run: withFigure(saveSvg) },
  ]
}

/** The commands of all time plots. */
function plotEntries(): Entries {
  const { range, cursors, measuring } = useWindow.getState()
  const { radians } = useUnits.getState()
  return [
    {
      title: 'Show the whole run',
      enabled: range !== null,
      run: () => useWindow.setState({ range: null }),
    },
    { title: 'Trigger', checked: useTrigger.getState().on, run: toggleTrigger },
    { title: 'Measuring cursors', checked: cursors !== null, run: toggleCursors },
    {
      title: 'Measures of the visible range',
      checked: measuring,
      run: () => useWindow.setState({ measuring: !measuring }),
    },
    {
      title: 'Angles in radians',
      checked: radians,
      run: () => useUnits.setState({ radians: !radians }),
    },
  ]
}

/** A submenu with the traces of a plot. */
function traceEntries(traces: Trace[], hidden: ReadonlySet<string>, toggle: (key: string) => void): Entries {
  if (traces.length < 2) return []
  const submenu = traces.map(({ key, label }) => ({
    title: label,
    checked: !hidden.has(key),
    run: () => toggle(key),
  }))
  return [{ title: 'Traces', submenu }]
}

/** The entry that shows the block at a path; a notebook has no sheet. */
function blockEntry(path: string): Entries {
  if (!useStudio.getState().document) return []
  const names = path.split('/')
  return [
    { title: 'Show the block on the sheet', run: () => void showBlock(names.slice(0, -1), names.at(-1)!) },
  ]
}
