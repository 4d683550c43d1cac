import { Select } from '@mantine/core'
import { useEffect, useState } from 'react'
import type { DataFile } from '../protocol'
import { SEARCHED } from '../searchable_lists'
import { ask } from '../store'

interface Props {
  holds: 'table' | 'function'
  label: React.ReactNode
  description: string
  /** The path of the file from the project folder, or `''`. */
  file: string
  focus: boolean
  onFile: (file: string) => void
}

const NO_FILES = {
  table: 'No CSV, NPZ, MAT or Parquet file in the project folder: drop one on the sheet.',
  function: 'No Python file in the project folder.',
}

/** Chooses a file of the project folder by typing a part of its path. */
export function DataFileSelect({ holds, label, description, file, focus, onFile }: Props) {
  const [files, setFiles] = useState<DataFile[] | null>(null)
  useEffect(() => void ask({ kind: 'data_files', holds }).then((list) => setFiles(list ?? [])), [holds])
  const paths = files?.map(({ path }) => path) ?? []
  return (
    <Select
      {...SEARCHED}
      openOnFocus={false}
      selectFirstOptionOnDropdownOpen={!file}
      label={label}
      description={description}
      data={file && !paths.includes(file) ? [file, ...paths] : paths}
      value={file || null}
      placeholder="Choose a file"
      onChange={(next) => next && onFile(next)}
      nothingFoundMessage={files?.length ? 'no such file' : files ? NO_FILES[holds] : 'reading the folder …'}
      data-autofocus={focus || undefined}
    />
  )
}
