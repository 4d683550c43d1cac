import { lazy, Suspense } from 'react'
import { useTabs } from './tabs'

const TabStrip = lazy(async () => ({ default: (await import('./tab_strip')).TabStrip }))

/** The tabs of the open documents, if this client has several; loaded on demand. */
export function DocumentTabs() {
  const several = useTabs((s) => s.tabs.length > 1)
  if (!several) return null
  return (
    <div className="document-tabs">
      <Suspense>
        <TabStrip />
      </Suspense>
    </div>
  )
}
