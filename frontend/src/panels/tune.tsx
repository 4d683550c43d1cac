import { later } from '../later'
import { inFront, type Panel } from '../panel'

const TunePanel = later(async () => (await import('../run/tune_panel')).TunePanel, 'Loading the parameters …')

export const panel: Panel = {
  title: 'Tune',
  component: inFront(TunePanel),
  order: 5,
  place: { behind: 'robot' },
}
