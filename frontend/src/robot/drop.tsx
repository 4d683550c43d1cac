import { Text } from '@mantine/core'
import { IconFileImport } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import { ask, refuse } from '../store'
import './robot.css'

const MAX_BYTES = 5 * 2 ** 20

/** Whether a file contains a table of measurements, by its name. */
const isTable = (file: File): boolean => /\.(csv|npz|mat|parquet)$/i.test(file.name)

/** Opens the files that are dropped on the page: robot scripts, robots, diagrams, tables. */
export function DropZone() {
  const [dragging, setDragging] = useState(false)
  useEffect(() => {
    const hasFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false
    const enter = (event: DragEvent) => {
      if (!hasFiles(event)) return
      event.preventDefault()
      setDragging(true)
    }
    const leave = (event: DragEvent) => {
      if (!event.relatedTarget) setDragging(false)
    }
    const drop = (event: DragEvent) => {
      if (!hasFiles(event)) return
      event.preventDefault()
      setDragging(false)
      const at = { x: event.clientX, y: event.clientY }
      for (const file of event.dataTransfer?.files ?? [])
        void (isTable(file) ? addTable(file, at) : open(file))
    }
    addEventListener('dragenter', enter)
    addEventListener('dragover', enter)
    addEventListener('dragleave', leave)
    addEventListener('drop', drop)
    return () => {
      removeEventListener('dragenter', enter)
      removeEventListener('dragover', enter)
      removeEventListener('dragleave', leave)
      removeEventListener('drop', drop)
    }
  }, [])
  if (!dragging) return null
  return (
    <div className="drop-zone">
      <IconFileImport size={34} />
      <Text fw={600}>Drop the file to open it</Text>
      <Text size="sm">a robot (.urdf, .sdf, .xml), a robot script (.m), a robot or a diagram (.json)</Text>
      <Text size="sm">measurements (.csv, .parquet, .mat, .npz) become a block of the sheet</Text>
    </div>
  )
}

/** Send a file to the server, which reads it as data; scripts are not executed. */
export async function open(file: File): Promise<void> {
  const content = await base64Of(file)
  if (content !== null) await ask({ kind: 'drop', name: file.name, content })
}

/** Store a file with measurements in the project folder, and add a block that plays it back. */
async function addTable(file: File, at: { x: number; y: number }): Promise<void> {
  const content = await base64Of(file)
  if (content === null) return
  const { dropTable } = await import('../canvas/dropped_table')
  await dropTable(file.name, content, at)
}

/** The content of a file; null if it is too large. */
async function base64Of(file: File): Promise<string | null> {
  if (file.size > MAX_BYTES) {
    refuse({
      what: `the file has ${(file.size / 2 ** 20).toFixed(1)} MiB, and 5 MiB can be dropped`,
      where: file.name,
      fix: 'put it into the project folder and choose it there',
    })
    return null
  }
  const bytes = new Uint8Array(await file.arrayBuffer())
  let text = ''
  for (let k = 0; k < bytes.length; k += 0x8000) text += String.fromCharCode(...bytes.subarray(k, k + 0x8000))
  return btoa(text)
}
