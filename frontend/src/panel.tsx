import type { DockviewApi, IDockviewPanelProps } from 'dockview-react'
import { useEffect, useState, type ComponentType, type FunctionComponent } from 'react'

type PanelComponent = FunctionComponent<IDockviewPanelProps>

/** A panel of the studio. Each file in `panels/` exports one as `panel`; the file name is its key. */
export interface Panel {
  title: string
  component: PanelComponent
  /** Order in which panels are added; each takes its space from the panel beside which it is placed. */
  order: number
  /**
   * Initial position: beside another panel, with a size in px, or as a tab behind it. The first panel has no
   * position.
   */
  place?: { beside: string; side: 'left' | 'right' | 'below'; size: number } | { behind: string }
}

/** The panels of these files: components by key, and a function that adds all panels to the dock. */
export function panelsOf(files: Record<string, { panel: Panel }>) {
  const panels = Object.entries(files)
    .map(([path, { panel }]) => ({ id: path.replace(/^.*\/|\.tsx$/g, ''), ...panel }))
    .sort((one, other) => one.order - other.order)
  const components: Record<string, PanelComponent> = Object.fromEntries(
    panels.map((one) => [one.id, one.component]),
  )
  const arrange = ({ api }: { api: Pick<DockviewApi, 'addPanel'> }): void => {
    for (const { id, title, place } of panels)
      api.addPanel({ id, component: id, title, ...dockOptions(place) })
  }
  /** Add a panel again that was removed: at the right edge of the dock. */
  const addTo = (api: Pick<DockviewApi, 'addPanel'>, id: string): void => {
    const one = panels.find((panel) => panel.id === id)
    if (!one) return
    const size = one.place && 'size' in one.place ? { initialWidth: one.place.size } : {}
    api.addPanel({ id, component: id, title: one.title, position: { direction: 'right' }, ...size })
  }
  return { components, arrange, addTo }
}

function dockOptions(place: Panel['place']) {
  if (!place) return {}
  if ('behind' in place) return { position: { referencePanel: place.behind }, inactive: true }
  const { beside, side, size } = place
  const position = { referencePanel: beside, direction: side }
  return side === 'below' ? { position, initialHeight: size } : { position, initialWidth: size }
}

/** A panel that is rendered when it first becomes visible. */
export function whenVisible(Part: ComponentType): PanelComponent {
  return function Panel({ api }) {
    const [wasVisible, setWasVisible] = useState(api.isVisible)
    useEffect(() => {
      if (api.isVisible) setWasVisible(true)
      const subscription = api.onDidVisibilityChange(({ isVisible }) => isVisible && setWasVisible(true))
      return () => subscription.dispose()
    }, [api])
    return wasVisible ? <Part /> : null
  }
}
