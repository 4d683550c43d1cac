import type { SheetBlock, Wire } from '../protocol'

/**
 * The first unconnected input of a block, or its first output; undefined if there is none. With `frame`: its
 * first frame port, preferably an unconnected one.
 */
export function freePort(
  { name, inputs, outputs }: SheetBlock,
  input: boolean,
  wires: readonly Wire[],
  frame = false,
): string | undefined {
  const connected = new Set(wires.flatMap(({ source, target }) => (frame ? [source, target] : [target])))
  const ports = (input ? inputs : outputs)
    .filter((port) => Boolean(port.frame) === frame)
    .map((port) => `${name}/${port.name}`)
  const free = ports.find((port) => !connected.has(port))
  return frame ? (free ?? ports[0]) : input ? free : ports[0]
}
