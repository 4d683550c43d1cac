import { later } from '../later'
import { inFront, type Panel } from '../panel'

const SignalInspector = later(
  async () => (await import('../scopes/inspector')).SignalInspector,
  'Loading the signals …',
)

export const panel: Panel = {
  title: 'Signals',
  component: inFront(SignalInspector),
  order: 7,
  place: { behind: 'scopes' },
}
