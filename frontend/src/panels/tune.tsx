import { deferred } from '../deferred'
import { whenVisible, type Panel } from '../panel'

const TunePanel = deferred(
  async () => (await import('../run/tune_panel')).TunePanel,
  'Loading the parameters …',
)

export const panel: Panel = {
  title: 'Tune',
  component: whenVisible(TunePanel),
  order: 5,
  place: { behind: 'robot' },
}
