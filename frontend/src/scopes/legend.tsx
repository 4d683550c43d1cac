import { useElementSize, useMergedRef } from '@mantine/hooks'
import { useEffect, useLayoutEffect, useRef, useState } from 'react'
import { legendNames, type LegendName } from '../model/legend_names'
import { hasEntry, type Trace } from '../model/trace'

interface LegendProps {
  traces: Trace[]
  hidden: ReadonlySet<string>
  toggle: (key: string) => void
}

/**
 * The names of the traces, after the name of their common signal. Long names are cut to the available room;
 * their buttons have the whole names as tooltips and for screen readers.
 */
export function Legend({ traces, hidden, toggle }: LegendProps) {
  const stem = commonStem(traces)
  const names = [
    ...(stem ? [{ name: stem, entry: '' }] : []),
    ...traces.map((trace): LegendName => {
      if (stem) return { name: trace.entry, entry: '' }
      return hasEntry(trace) ? { name: trace.stem, entry: trace.entry } : { name: trace.label, entry: '' }
    }),
  ]
  const { ref, texts } = useFittedNames(names)
  const shown = stem ? texts.slice(1) : texts
  return (
    <span className="legend" ref={ref}>
      {stem && (
        <span className="stem" title={stem}>
          <span>{texts[0]}</span>
        </span>
      )}
      {traces.map((trace, k) => (
        <LegendEntry
          key={trace.key}
          trace={trace}
          text={shown[k] ?? ''}
          hidden={hidden.has(trace.key)}
          toggle={() => toggle(trace.key)}
        />
      ))}
    </span>
  )
}

/** The texts of the names that fit into the legend, measured in its font. */
function useFittedNames(names: LegendName[]) {
  const legend = useRef<HTMLSpanElement>(null)
  const { ref: sizeRef, width } = useElementSize<HTMLSpanElement>()
  const ref = useMergedRef(legend, sizeRef)
  const [texts, setTexts] = useState<string[]>([])
  const fontsLoaded = useFontsLoaded()
  const key = names.map(({ name, entry }) => `${name}\t${entry}`).join('\n')
  useLayoutEffect(() => {
    const element = legend.current
    if (element) setTexts(fittedNames(element, names))
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [key, width, fontsLoaded])
  return { ref, texts }
}

/** Whether the fonts of the page are loaded: before, other fonts have other widths. */
function useFontsLoaded(): boolean {
  const [loaded, setLoaded] = useState(document.fonts.status === 'loaded')
  useEffect(() => {
    let shown = true
    void document.fonts.ready.then(() => shown && setLoaded(true))
    return () => void (shown = false)
  }, [])
  return loaded
}

const canvas = document.createElement('canvas').getContext('2d')

function fittedNames(legend: HTMLElement, names: LegendName[]): string[] {
  const entries = [...legend.children].map((entry) => ({
    entry: entry as HTMLElement,
    text: entry.lastElementChild as HTMLElement,
  }))
  // A narrow chart hides the name of the common signal.
  const visible = names.filter((_, k) => entries[k]?.entry.offsetWidth)
  const { font, paddingRight, columnGap } = getComputedStyle(legend)
  if (canvas) canvas.font = entries.length ? getComputedStyle(entries.at(-1)!.text).font : font
  const gaps = (Number.parseFloat(columnGap) || 0) * Math.max(visible.length - 1, 0)
  const around = entries.reduce((sum, { entry, text }) => sum + entry.offsetWidth - text.offsetWidth, 0)
  const room = legend.clientWidth - Number.parseFloat(paddingRight) - gaps - around
  // Half a pixel for each text, because the browser rounds widths.
  const fitted = legendNames(visible, room, (text) => (canvas?.measureText(text).width ?? 0) + 0.5)
  let next = 0
  return names.map(({ name }, k) => (entries[k]?.entry.offsetWidth ? fitted[next++]! : name))
}

interface LegendEntryProps {
  trace: Trace
  text: string
  hidden: boolean
  toggle: () => void
}

/** A trace in the legend. */
function LegendEntry({ trace: { label, tone, dash }, text, hidden, toggle }: LegendEntryProps) {
  return (
    <button
      type="button"
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
      <span>{text}</span>
    </button>
  )
}

/** The signal to which all traces belong; the legend then shows only their entries. */
function commonStem(traces: Trace[]): string {
  const stem = traces[0]?.stem ?? ''
  return traces.length > 1 && traces.every((one) => one.stem === stem && hasEntry(one)) ? stem : ''
}
