import type { DockviewApi } from 'dockview-react'

/** The dock of the panels; `null` before it is shown. */
let dock: DockviewApi | null = null

export function setDock(api: DockviewApi): void {
  dock = api
}

const HIGHLIGHT_MS = 1200
/** Maximum time to wait for a chart, whose code is loaded at the first run. */
const CHART_TIMEOUT_MS = 3000

/** Show the chart of a block in the panel of the scopes, and highlight it for 1.2 s. */
export function showScope(path: string): void {
  dock?.getPanel('scopes')?.api.setActive()
  const end = performance.now() + CHART_TIMEOUT_MS
  const highlight = () => {
    const chart = document.querySelector(`.scopes [data-view="${CSS.escape(path)}"]`)
    if (!chart) {
      if (performance.now() < end) requestAnimationFrame(highlight)
      return
    }
    chart.scrollIntoView({ block: 'nearest', inline: 'nearest' })
    chart.classList.add('marked')
    setTimeout(() => chart.classList.remove('marked'), HIGHLIGHT_MS)
  }
  requestAnimationFrame(highlight)
}
