import { later } from '../later'
import { inFront, type Panel } from '../panel'

const Explorer = later(async () => (await import('../library/explorer')).Explorer, 'Loading the tree …')

export const panel: Panel = {
  title: 'Model',
  component: inFront(Explorer),
  order: 3,
  place: { behind: 'library' },
}
