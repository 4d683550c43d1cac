import type { Wire } from '../protocol'

export const wireKey = (wire: Wire): string => `${wire.source} -> ${wire.target}`
export const blockOf = (port: string): string => port.slice(0, port.lastIndexOf('/'))
export const portOf = (port: string): string => port.slice(port.lastIndexOf('/') + 1)

/** Blocks by name, at their displayed positions (which a drag may have changed). */
export type Places = Record<string, { x: number; y: number; flipped?: boolean }>
