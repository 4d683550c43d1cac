import type { DocumentState, Envelope, Replies, ServerMessage } from './protocol'

export type Request = Envelope['request']
/** The value of the reply to a request, as declared in Python. */
export type ReplyTo<R extends Request> = Replies[R['kind']]
/** An edit of a document; the server refuses edits for another kind of document. */
export type Edit = Extract<Request, { kind: 'change' }>['edit']
export type DocumentKind = DocumentState['kind']
export type ServerEvent = ServerMessage['event']
export type EventOf<K extends ServerEvent['kind']> = Extract<ServerEvent, { kind: K }>
export type ContentOf<K extends DocumentKind> = Extract<EventOf<'opened'>['content'], { kind: K }>
export type ChangeOf<K extends DocumentKind> = Extract<EventOf<'changed'>['change'], { kind: K }>
