import type { DockviewApi, IDockviewPanelProps } from 'dockview-react'
import { useEffect, useState, type ComponentType, type FunctionComponent } from 'react'

type Body = FunctionComponent<IDockviewPanelProps>

/** A panel of the studio. Each file of `panels/` exports one as `panel`; the name of the file is its key. */
export interface Panel {
  title: string
  component: Body
  /** Panels are added in this order: each takes its space from the one beside which it stands. */
  order: number
  /**
   * Where it is at first: beside another panel, with a size in px, or a tab behind it. The first panel has
   * no place.
   */
  place?: { beside: string; side: 'left' | 'right' | 'below'; size: number } | { behind: string }
}

/** The panels of these files: their components by key, and what adds all of them to the dock. */
export function panelsOf(files: Record<string, { panel: Panel }>) {
  const panels = Object.entries(files)
    .map(([path, { panel }]) => ({ id: path.replace(/^.*\/|\.tsx$/g, ''), ...panel }))
    .sort((one, other) => one.order - other.order)
  const components: Record<string, Body> = Object.fromEntries(panels.map((one) => [one.id, one.component]))
  const arrange = ({ api }: { api: Pick<DockviewApi, 'addPanel'> }): void => {
    for (const { id, title, place } of panels) api.addPanel({ id, component: id, title, ...spot(place) })
  }
  return { components, arrange }
}

function spot(place: Panel['place']) {
  if (!place) return {}
  if ('behind' in place) return { position: { referencePanel: place.behind }, inactive: true }
  const { beside, side, size } = place
  const position = { referencePanel: beside, direction: side }
  return side === 'below' ? { position, initialHeight: size } : { position, initialWidth: size }
}

/** A panel that is rendered when it is first shown: hidden panels cost nothing. */
export function inFront(Part: ComponentType): Body {
  return function Panel({ api }) {
    const [seen, setSeen] = useState(api.isVisible)
    useEffect(() => {
      if (api.isVisible) setSeen(true)
      const watch = api.onDidVisibilityChange(({ isVisible }) => isVisible && setSeen(true))
      return () => watch.dispose()
    }, [api])
    return seen ? <Part /> : null
  }
}
