import { deferred } from '../deferred'
import { whenVisible, type Panel } from '../panel'

const SignalInspector = deferred(
  async () => (await import('../scopes/inspector')).SignalInspector,
  'Loading the signals …',
)

export const panel: Panel = {
  title: 'Signals',
  component: whenVisible(SignalInspector),
  order: 7,
  place: { behind: 'scopes' },
}
