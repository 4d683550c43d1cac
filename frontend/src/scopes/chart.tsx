import { ActionIcon, Menu } from '@mantine/core'
import { IconArrowsVertical, IconDownload } from '@tabler/icons-react'
import { useRef, useState } from 'react'
import { useRuns } from '../run/runs'
import { saveCsv, savePng, saveSvg } from './export'
import { MeasureTable } from './measure_table'
import { Plot, type PlotHandle } from './plot'
import type { Values } from './plot_gestures'
import type { Trace } from '../model/trace'
import { useWindow } from './window'
import { XyPlot } from './xy_plot'

/** Number of letters of a name that the legend always shows. */
const SHORT = 8

/** A plot with its title, legend (a click hides a trace), export menu and table of measures. */
export function Chart({
  title,
  traces,
  path = false,
  view,
  band,
}: {
  title: string
  traces: Trace[]
  path?: boolean
  /** The block whose signals are shown. */
  view?: string
  band?: number
}) {
  const [hidden, setHidden] = useState<ReadonlySet<string>>(new Set())
  const [values, setValues] = useState<Values | null>(null)
  const measured = useWindow((s) => s.measuring || s.cursors !== null) && !path
  const handle = useRef<PlotHandle>(null)
  const { stem, names } = shortened(traces)
  const toggle = (key: string) =>
    setHidden((now) => {
      const next = new Set(now)
      if (!next.delete(key)) next.add(key)
      return next
    })
  return (
    <figure className={measured ? 'chart measured' : 'chart'} data-view={view}>
      <figcaption>
        <b>{title}</b>
        <span className="legend">
          {!path && stem && <span className="stem">{stem}</span>}
          {!path &&
            traces.map((trace, k) => (
              <Key
                key={trace.key}
                trace={trace}
                name={names[k]!}
                hidden={hidden.has(trace.key)}
                toggle={() => toggle(trace.key)}
              />
            ))}
        </span>
        {values && (
          <ActionIcon
            className="all-values"
            variant="light"
            color="accent"
            size="xs"
            aria-label={`Show all values of ${title}`}
            title="Show all values"
            onClick={() => setValues(null)}
          >
            <IconArrowsVertical size={13} />
          </ActionIcon>
        )}
        <Exports title={title} traces={traces} figure={() => handle.current?.figure()} />
      </figcaption>
      <div className="with-measures">
        {path ? (
          <XyPlot traces={traces} title={title} handle={handle} />
        ) : (
          <Plot
            traces={traces}
            hidden={hidden}
            title={title}
            handle={handle}
            values={values}
            onValues={setValues}
            {...(band === undefined ? {} : { band })}
          />
        )}
        {measured && <MeasureTable traces={traces.filter(({ key }) => !hidden.has(key))} />}
      </div>
    </figure>
  )
}

interface KeyProps {
  trace: Trace
  name: string
  hidden: boolean
  toggle: () => void
}

/** A trace in the legend. */
function Key({ trace: { label, tone, dash }, name, hidden, toggle }: KeyProps) {
  return (
    <button
      type="button"
      className={name.length > SHORT ? 'long' : undefined}
      aria-label={label}
      aria-pressed={!hidden}
      title={hidden ? `Show ${label}` : `Hide ${label}`}
      onClick={toggle}
    >
      <svg width="16" height="4" aria-hidden>
        <line
          x1="0"
          x2="16"
          y1="2"
          y2="2"
          stroke={`var(--${tone})`}
          strokeWidth="2.5"
          strokeDasharray={dash.join(' ')}
        />
      </svg>
      <span>{name}</span>
    </button>
  )
}

interface ExportsProps {
  title: string
  traces: Trace[]
  figure: () => ReturnType<PlotHandle['figure']> | undefined
}

function Exports({ title, traces, figure }: ExportsProps) {
  const stride = useRuns((s) => s.runs.at(-1)?.stride ?? 1)
  return (
    <Menu position="bottom-end" shadow="md">
      <Menu.Target>
        <ActionIcon className="more" variant="subtle" color="gray" size="xs" aria-label={`Export ${title}`}>
          <IconDownload size={13} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item onClick={() => saveCsv(title, traces)}>
          {stride > 1 ? `Extremes of every ${stride} samples as CSV` : 'Samples as CSV'}
        </Menu.Item>
        <Menu.Item onClick={() => figure() && void savePng(figure()!)}>Picture as PNG</Menu.Item>
        <Menu.Item onClick={() => figure() && saveSvg(figure()!)}>Picture as SVG</Menu.Item>
      </Menu.Dropdown>
    </Menu>
  )
}

/** The names of entries without the name of their common signal. */
function shortened(traces: Trace[]): { stem: string; names: string[] } {
  const stem = traces[0]?.stem
  if (!stem || traces.length < 2 || !traces.every((one) => one.entry && one.label === `${stem} ${one.entry}`))
    return { stem: '', names: traces.map(({ label }) => label) }
  return { stem, names: traces.map(({ entry }) => entry) }
}
