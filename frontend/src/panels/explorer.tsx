import { deferred } from '../deferred'
import { whenVisible, type Panel } from '../panel'

const Explorer = deferred(async () => (await import('../library/explorer')).Explorer, 'Loading the tree …')

export const panel: Panel = {
  title: 'Model',
  component: whenVisible(Explorer),
  order: 3,
  place: { behind: 'library' },
}
