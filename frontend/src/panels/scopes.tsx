import { deferred } from '../deferred'
import type { Panel } from '../panel'
import { useStudio } from '../store'

const Scopes = deferred(async () => {
  await import('../scopes/document_trigger')
  return (await import('../scopes/scopes')).Scopes
}, 'Loading the scopes …')

function ScopesPanel() {
  const hasRun = useStudio((s) => s.run !== null)
  return hasRun ? <Scopes /> : <p className="empty">Run the model (Ctrl+Enter) to see its scopes here.</p>
}

export const panel: Panel = {
  title: 'Scopes',
  component: ScopesPanel,
  order: 6,
  place: { beside: 'canvas', side: 'below', size: Math.min(460, 0.34 * innerHeight) },
}
