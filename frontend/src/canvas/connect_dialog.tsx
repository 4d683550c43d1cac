import { Button, Group, Modal, Select, Stack } from '@mantine/core'
import { useEffect, useMemo, useState } from 'react'
import { showDialog, useDialogs } from '../dialogs'
import { isFrame, mixedKinds, sameKind } from '../model/wires'
import type { SheetBlock, Wire } from '../protocol'
import { SEARCHED } from '../searchable_lists'
import { change, refuse, useStudio } from '../store'

/**
 * Options of the port fields. Without `selectFirstOptionOnDropdownOpen`, Mantine resets the highlighted
 * option in a timer after the list opens; on a busy machine this happens after the first keys, and Enter
 * selects nothing.
 */
const PORT_SELECT = { ...SEARCHED, selectFirstOptionOnDropdownOpen: true } as const

/** The ports at which a wire from a source may end: unconnected inputs, or frame ports. */
function freeTargets(blocks: Record<string, SheetBlock>, wires: Wire[], source: string | null): string[] {
  const driven = new Set(wires.map((wire) => wire.target))
  return Object.values(blocks)
    .flatMap(({ name, inputs }) => inputs.map((port) => ({ ref: `${name}/${port.name}`, frame: port.frame })))
    .filter(({ ref, frame }) => frame || !driven.has(ref))
    .filter(({ ref }) => !source || (ref !== source && sameKind(blocks, source, ref)))
    .map(({ ref }) => ref)
}

/** Draws a wire by keyboard: type the names of two ports. The ports of the selected block are suggested. */
export function ConnectDialog() {
  const opened = useDialogs((s) => s.open === 'connect')
  const blocks = useStudio((s) => s.document?.blocks)
  const wires = useStudio((s) => s.document?.wires)
  const selection = useStudio((s) => s.selection)
  const connectTo = useDialogs((s) => s.connectTo)
  const [source, setSource] = useState<string | null>(null)
  const [target, setTarget] = useState<string | null>(null)
  const close = () => showDialog(null)
  const sources = useMemo(
    () =>
      Object.values(blocks ?? {}).flatMap(({ name, outputs }) =>
        outputs.map((port) => `${name}/${port.name}`),
      ),
    [blocks],
  )
  const targets = useMemo(() => freeTargets(blocks ?? {}, wires ?? [], source), [blocks, wires, source])
  useEffect(() => {
    if (!opened) return
    const portOfSelection = (ports: string[]) =>
      ports.find((port) => [...selection].some((name) => port.startsWith(`${name}/`))) ?? null
    setSource(connectTo?.isOutput ? connectTo.port : connectTo ? null : portOfSelection(sources))
    if (connectTo) setTarget(connectTo.isOutput ? null : connectTo.port)
    else setTarget(selection.size > 1 ? portOfSelection(targets) : null)
    // The suggestion is computed once, when the dialog opens.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [opened])
  const connect = () => {
    if (!source || !target) return
    close()
    if (sameKind(blocks ?? {}, source, target)) void change({ kind: 'connect', wire: { source, target } })
    else refuse(mixedKinds(source, target))
  }
  return (
    <Modal opened={opened} onClose={close} title={<b>Draw a wire</b>} size="sm">
      <form
        onSubmit={(event) => {
          event.preventDefault()
          connect()
        }}
      >
        <Stack gap="sm">
          <Select
            {...PORT_SELECT}
            label="From the output"
            data={sources}
            value={source}
            onChange={setSource}
            data-autofocus={!source || undefined}
            nothingFoundMessage="no such output"
          />
          <Select
            {...PORT_SELECT}
            label="To the input"
            data={targets}
            value={target}
            onChange={setTarget}
            data-autofocus={source ? true : undefined}
            nothingFoundMessage={
              source && isFrame(blocks ?? {}, source) ? 'no such frame port' : 'no such free input'
            }
          />
          <Group justify="flex-end" gap="xs">
            <Button variant="default" onClick={close}>
              Cancel
            </Button>
            <Button type="submit" disabled={!source || !target}>
              Connect
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  )
}
