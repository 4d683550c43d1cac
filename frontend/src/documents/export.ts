import { useStudio } from '../store'

const REQUEST_OPTIONS = { headers: { 'X-Armblocks': '1' } }

/**
 * Save a drawing of the visible sheet, as `armblocks diagram` does; SVG and PNG have the present theme.
 */
export function exportDrawing(kind: 'svg' | 'png' | 'pdf'): void {
  const { document } = useStudio.getState()
  if (!document) return
  const query = new URLSearchParams({ sheet: document.inside.join('/') })
  void download(
    `drawing/${document.state.document}.${kind}?${query}`,
    [document.state.title, ...document.inside].join('-') + `.${kind}`,
  )
}

async function download(path: string, name: string): Promise<void> {
  const response = await fetch(path, REQUEST_OPTIONS)
  if (!response.ok) throw new Error(await response.text())
  const link = window.document.createElement('a')
  link.href = URL.createObjectURL(await response.blob())
  link.download = name
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 1000)
}

/** Open the report of the model in another tab; it equals the report of the command line. */
export function openReport(): void {
  const { document } = useStudio.getState()
  if (document) window.open(`report/${document.state.document}`, '_blank')
}
