import { Alert, Badge, Button, Group, NativeSelect, Stack, Text } from '@mantine/core'
import { useCallback, useEffect, useRef, useState } from 'react'
import { Refusal } from '../connection'
import type { FunctionSource, ParameterRule, SheetBlock } from '../protocol'
import { ask, change, connection, useStudio } from '../store'
import { DataFileSelect } from './data_file_select'

interface Props {
  rule: ParameterRule
  block: SheetBlock
  /** `file.py:name`, or `''` for the default function. */
  text: string
  /** The function of the block as it was when the dialog was opened. */
  initial: string
  focus: boolean
  onText: (text: string) => void
}

/** A parameter that is a function of a Python file of the project folder: source, trust, reload. */
export function FunctionField({ rule, block, text, initial, focus, onText }: Props) {
  const lastColon = text.lastIndexOf(':')
  const [typedFile, setFile] = useState(text.slice(0, Math.max(lastColon, 0)))
  const name = text.slice(lastColon + 1)
  const { source, refusal, load } = useSource(typedFile)
  const fault = refusal ?? source?.fault ?? null
  const functions = source?.functions ?? []
  const selected = functions.find((entry) => entry.name === name)
  useEffect(() => {
    // The first function of another file is selected.
    if (source && functions.length && !selected) onText(`${typedFile}:${functions[0]!.name}`)
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [source])
  const reload = async () => {
    const newSource = await load()
    const inputs = newSource?.functions.find((entry) => entry.name === name)?.arguments.filter(isInput)
    const ports = block.inputs.map((port) => port.name)
    // The input ports of the block are derived from the arguments.
    if (inputs && text === initial && inputs.join() !== ports.join())
      await change({ kind: 'parameters', block: block.name, values: { [rule.name]: text } })
  }
  const trust = async (trusted: boolean) => {
    if (!source) return
    await ask({ kind: 'trust_source', file: typedFile, digest: source.digest, trusted })
    await load()
  }
  return (
    <Stack gap="xs" className="data-field">
      <Group align="end" wrap="nowrap" gap="xs">
        <div className="spring">
          <DataFileSelect
            holds="function"
            label={rule.name}
            description={typedFile ? rule.doc : `${rule.doc}; now the default of a new block`}
            file={typedFile}
            focus={focus}
            onFile={(file) => (setFile(file), onText(''))}
          />
        </div>
        {functions.length > 0 && (
          <NativeSelect
            aria-label="Function"
            size="sm"
            data={functions.map((entry) => ({
              value: entry.name,
              label: `${entry.name}(${entry.arguments.join(', ')})`,
            }))}
            value={name}
            onChange={(event) => onText(`${typedFile}:${event.currentTarget.value}`)}
          />
        )}
      </Group>
      {fault && (
        <Alert color="red" variant="light" p="xs" role="alert">
          <Text size="sm">{fault.what}.</Text>
          <Text size="xs" c="dimmed">
            {fault.fix}
          </Text>
        </Alert>
      )}
      {source && !fault && !functions.length && (
        <Alert color="red" variant="light" p="xs" role="alert">
          The file defines no function at its top level.
        </Alert>
      )}
      {source && (
        <Trust source={source} onTrust={(trusted) => void trust(trusted)} onReload={() => void reload()} />
      )}
      {source && <Source file={typedFile} source={source} block={block} line={selected?.line ?? 1} />}
    </Stack>
  )
}

const isInput = (argument: string): boolean => !argument.includes('=') && argument !== 't'

/** The content of a file; read again when the window gets the focus, after an edit in another program. */
function useSource(file: string) {
  const [state, setState] = useState<ReadState>({ file: '', source: null, refusal: null })
  const load = useCallback(async (): Promise<FunctionSource | null> => {
    if (!file) return null
    try {
      const source = await connection.ask({ kind: 'read_source', file })
      setState({ file, source, refusal: null })
      return source
    } catch (error) {
      if (!(error instanceof Refusal)) throw error
      setState({ file, source: null, refusal: error })
      return null
    }
  }, [file])
  useEffect(() => {
    const read = () => void load()
    read()
    addEventListener('focus', read)
    return () => removeEventListener('focus', read)
  }, [load])
  const isCurrent = state.file === file
  return { source: isCurrent ? state.source : null, refusal: isCurrent ? state.refusal : null, load }
}

interface ReadState {
  file: string
  source: FunctionSource | null
  refusal: Refusal | null
}

interface TrustProps {
  source: FunctionSource
  onTrust: (trusted: boolean) => void
  onReload: () => void
}

function Trust({ source, onTrust, onReload }: TrustProps) {
  const buttons = (
    <Button size="compact-sm" variant="default" onClick={onReload}>
      Reload
    </Button>
  )
  if (source.trusted)
    return (
      <Group gap="xs">
        <Badge color="green" variant="light">
          trusted
        </Badge>
        <Text size="xs" c="dimmed" className="spring">
          Runs execute this code. After a change of the file it must be trusted again.
        </Text>
        {buttons}
        <Button size="compact-sm" variant="subtle" color="red" onClick={() => onTrust(false)}>
          Revoke trust
        </Button>
      </Group>
    )
  return (
    <Alert color="yellow" variant="light" p="xs" title="This code has not been trusted">
      <Text size="sm">
        The code does not run yet. Once you trust the code, runs execute it and the modules that it imports,
        with all your permissions on this computer. Trust the code only if you have read it.
      </Text>
      {source.hidden > 0 && (
        <Text size="sm" c="red">
          It contains {source.hidden} invisible characters, shown as \u….
        </Text>
      )}
      <Group gap="xs" mt={6}>
        <Button size="compact-sm" color="yellow" variant="filled" onClick={() => onTrust(true)}>
          Trust this code
        </Button>
        {buttons}
      </Group>
    </Alert>
  )
}

interface SourceProps {
  file: string
  source: FunctionSource
  block: SheetBlock
  /** The line of the selected function, which is scrolled into view. */
  line: number
}

/** The source code, read-only; lines that errors name are marked. */
function Source({ file, source, block, line: selectedLine }: SourceProps) {
  const findings = useStudio((s) => s.document?.findings)
  const inside = useStudio((s) => s.document?.inside)
  const path = [...(inside ?? []), block.name].join('/')
  const blockFindings = source.trusted
    ? (findings?.filter((finding) => finding.block === path && !finding.port) ?? [])
    : []
  const messages = blockFindings.map(({ what }) => what)
  const faulty = new Set([...messages, source.fault?.what ?? ''].flatMap(linesIn))
  const shownLine = [...faulty][0] ?? (source.trusted ? selectedLine : 1)
  const codeElement = useRef<HTMLPreElement>(null)
  useEffect(() => {
    const row = codeElement.current?.children[shownLine - 1]
    if (codeElement.current && row instanceof HTMLElement) codeElement.current.scrollTop = row.offsetTop - 8
  }, [shownLine, source])
  return (
    <>
      {messages.map((what) => (
        <Text key={what} size="sm" c="red" role="alert">
          {what}
        </Text>
      ))}
      <pre ref={codeElement} className="source-code" tabIndex={0} aria-label={`Source of ${file}`}>
        {source.text.split('\n').map((text, number) => (
          <code key={number} className={faulty.has(number + 1) ? 'faulty' : undefined} data-line={number + 1}>
            {text || ' '}
          </code>
        ))}
      </pre>
    </>
  )
}

const linesIn = (what: string): number[] =>
  [...what.matchAll(/\bline (\d+)/g)].map((match) => Number(match[1]))
