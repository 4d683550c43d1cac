import type { BlockType, Fault, SheetBlock, SheetPort, Wire } from '../protocol'

export const wireKey = (wire: Wire): string => `${wire.source} -> ${wire.target}`
export const blockOf = (port: string): string => port.slice(0, port.lastIndexOf('/'))
export const portOf = (port: string): string => port.slice(port.lastIndexOf('/') + 1)

/** Whether `block/port` is a frame port. Its lines carry no signal and have no direction. */
export const isFrame = (blocks: Readonly<Record<string, SheetBlock>>, ref: string): boolean =>
  blocks[blockOf(ref)]?.outputs.some(({ name, frame }) => frame && name === portOf(ref)) ?? false

/** Whether both ends of a wire carry signals, or both are frame ports. */
export const sameKind = (blocks: Readonly<Record<string, SheetBlock>>, one: string, other: string): boolean =>
  isFrame(blocks, one) === isFrame(blocks, other)

/** Why a frame port cannot be connected with a port of signals. */
export const mixedKinds = (one: string, other: string): Pick<Fault, 'what' | 'where' | 'fix'> => ({
  what: 'a frame port cannot be connected with an input or output of signals',
  where: `${one} and ${other}`,
  fix: 'connect frame ports with each other; joints and sensors have inputs and outputs on request',
})

/** The first input and output of a block for a wire of signals, or its first two frame ports. */
export function throughPorts({ inputs, outputs }: SheetBlock, frame: boolean): [SheetPort?, SheetPort?] {
  const ofKind = (port: SheetPort) => Boolean(port.frame) === frame
  const [input, second] = inputs.filter(ofKind)
  return frame ? [input, second ?? input] : [input, outputs.find(ofKind)]
}

/** The same for a new block: the names of its ports. */
export function newThroughPorts({ inputs, outputs, frames }: BlockType, frame: boolean): [string?, string?] {
  return frame ? [frames[0], frames[1] ?? frames[0]] : [inputs[0], outputs[0]]
}

/** Blocks by name, at their displayed positions (which a drag may have changed). */
export type Places = Record<string, { x: number; y: number; flipped?: boolean }>
