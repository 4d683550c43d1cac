import type { SheetBlock, Wire } from '../protocol'

/** The first unconnected input of a block, or its first output; undefined if there is none. */
export function freePort(
  { name, inputs, outputs }: SheetBlock,
  input: boolean,
  wires: readonly Wire[],
): string | undefined {
  const connected = new Set(wires.map(({ target }) => target))
  const ports = (input ? inputs : outputs).map((port) => `${name}/${port.name}`)
  return input ? ports.find((port) => !connected.has(port)) : ports[0]
}
