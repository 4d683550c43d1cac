import type uPlot from 'uplot'
import { tickText } from '../model/axis_texts'
import type { Trace } from '../model/trace'
import { CLICK_PX, cursorUnder } from './plot_gestures'
import { colour, drawBand, drawLines } from './plot_marks'
import { useWindow, zoomTo } from './window'

const FONT = '11px "Inter Variable", system-ui, sans-serif'
/** Width and height of a plot before its panel has a size, px. */
export const MIN_PX = 60
const TIME_TEXTS_HEIGHT = 32
const LABEL_HEIGHT = 16
/** Height of the texts and the label below a plot, px. */
export const TIME_AXIS_HEIGHT = TIME_TEXTS_HEIGHT + LABEL_HEIGHT

/**
 * The uPlot options of the traces; `label` and `unitFactor` belong to the vertical axis, `band` a band
 * about zero.
 */
export function plotOptions(
  element: HTMLElement,
  traces: Trace[],
  label: () => string,
  unitFactor: () => number,
  band: number | undefined,
): uPlot.Options {
  const axis = {
    stroke: colour('muted'),
    grid: { stroke: colour('grid'), width: 1 },
    ticks: { stroke: colour('grid'), width: 1 },
    font: FONT,
    labelFont: FONT,
    labelSize: LABEL_HEIGHT,
    labelGap: 0,
  }
  return {
    width: Math.max(element.clientWidth, MIN_PX),
    height: Math.max(element.clientHeight, MIN_PX),
    legend: { show: false },
    cursor: {
      points: { show: false },
      drag: { x: true, y: false, setScale: false },
      bind: {
        dblclick: () => () => (useWindow.setState({ range: null }), null),
        mousedown: (u, _, handler) => (event) =>
          cursorUnder(u, event) !== null || event.button || event.shiftKey ? null : handler(event),
      },
    },
    scales: { x: { time: false, auto: false }, y: { auto: false } },
    axes: [
      {
        ...axis,
        size: TIME_TEXTS_HEIGHT,
        label: 'Time, s',
        values: (_, splits) => splits.map((value) => tickText(value, stepOf(splits))),
      },
      {
        ...axis,
        size: (_, texts) => valueAxisWidth(texts ?? []),
        label,
        values: (_, splits) => splits.map((value) => tickText(value, stepOf(splits))),
      },
    ],
    series: [
      {},
      ...traces.map(({ label, tone, dash }) => ({
        label,
        stroke: colour(tone),
        width: 1.5,
        dash,
        spanGaps: true,
        // Without this, uPlot rounds points to whole pixels, and slow curves have stairs.
        pxAlign: 0,
        points: { show: false },
      })),
    ],
    hooks: {
      drawClear: [(u) => band !== undefined && drawBand(u, band)],
      draw: [(u) => drawLines(u, traces, unitFactor())],
      setSelect: [
        (u) => {
          if (u.select.width < CLICK_PX) return
          zoomTo(u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x'))
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false)
        },
      ],
    },
  }
}

const stepOf = (splits: number[]) => Math.abs((splits[1] ?? 1) - (splits[0] ?? 0))

/** Width of the texts and ticks of the value axis, px: the same in all plots, except for long numbers. */
function valueAxisWidth(texts: string[]): number {
  const longest = Math.max(0, ...texts.map((text) => text.length))
  return Math.max(54, 18 + 6.6 * longest)
}
