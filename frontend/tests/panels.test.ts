import type { DockviewApi, IDockviewPanelProps } from 'dockview-react'
import { createElement, type FunctionComponent } from 'react'
import { renderToString } from 'react-dom/server'
import { expect, test } from 'vitest'
import { panelsOf, type Panel } from '../src/panel'

const ADDED = import.meta.glob<{ panel: Panel }>('./panels/*.tsx', { eager: true })

const none = () => null
const files = {
  '../src/panels/library.tsx': {
    panel: {
      title: 'Library',
      component: none,
      order: 2,
      place: { beside: 'canvas', side: 'left', size: 216 },
    },
  },
  '../src/panels/canvas.tsx': { panel: { title: 'Diagram', component: none, order: 1 } },
  '../src/panels/scopes.tsx': {
    panel: {
      title: 'Scopes',
      component: none,
      order: 3,
      place: { beside: 'canvas', side: 'below', size: 300 },
    },
  },
} satisfies Record<string, { panel: Panel }>

test('a file is a panel at its declared position', () => {
  const added: unknown[] = []
  const addPanel = ((options: unknown) => added.push(options)) as unknown as DockviewApi['addPanel']
  const { arrange, components } = panelsOf({ ...files, ...ADDED })
  arrange({ api: { addPanel } })
  const canvas = { referencePanel: 'canvas' }
  expect(added).toEqual([
    { id: 'canvas', component: 'canvas', title: 'Diagram' },
    {
      id: 'library',
      component: 'library',
      title: 'Library',
      position: { ...canvas, direction: 'left' },
      initialWidth: 216,
    },
    {
      id: 'doubled',
      component: 'doubled',
      title: 'Doubled',
      position: { referencePanel: 'library' },
      inactive: true,
    },
    {
      id: 'scopes',
      component: 'scopes',
      title: 'Scopes',
      position: { ...canvas, direction: 'below' },
      initialHeight: 300,
    },
  ])
  const Doubled = components['doubled'] as FunctionComponent<Partial<IDockviewPanelProps>>
  expect(renderToString(createElement(Doubled))).toContain('42')
})
