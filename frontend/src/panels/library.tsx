import { Palette } from '../library/palette'
import type { Panel } from '../panel'

export const panel: Panel = {
  title: 'Library',
  component: Palette,
  order: 2,
  place: { beside: 'canvas', side: 'left', size: 216 },
}
