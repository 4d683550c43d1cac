import type { Panel } from '../../src/panel'

/** A panel that is added by this single file. */
export const panel: Panel = {
  title: 'Doubled',
  component: () => <p>2 × 21 = {2 * 21}</p>,
  order: 2.5,
  place: { behind: 'library' },
}
