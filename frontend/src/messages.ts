import type { Envelope, Replies, ServerMessage } from './protocol'

export type Request = Envelope['request']
/** The value of the reply to a request: declared with its class in Python. */
export type ReplyTo<R extends Request> = Replies[R['kind']]
export type ServerEvent = ServerMessage['event']
export type EventOf<K extends ServerEvent['kind']> = Extract<ServerEvent, { kind: K }>
