import type { Envelope, ServerMessage } from './protocol'

export type Request = Envelope['request']
export type ServerEvent = ServerMessage['event']
export type EventOf<K extends ServerEvent['kind']> = Extract<ServerEvent, { kind: K }>
