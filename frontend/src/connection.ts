import type { Envelope, ServerMessage } from './protocol'

export type Request = Envelope['request']
export type ServerEvent = ServerMessage['event']
export type EventOf<K extends ServerEvent['kind']> = Extract<ServerEvent, { kind: K }>

/** Why the server refused a request. */
export class Refusal extends Error {
  constructor(
    readonly what: string,
    readonly where: string,
    readonly allowed: string,
    readonly fix: string,
  ) {
    super(what)
  }
}

interface Waiting {
  request: Request
  resolve: (value: unknown) => void
  reject: (reason: Refusal) => void
}

const FIRST_DELAY_MS = 250
const LONGEST_DELAY_MS = 4000

/**
 * The websocket to the server. Requests that were not answered when the line broke are sent again when it is back:
 * edits carry keys, so the server does each once.
 */
export class Connection {
  private socket: WebSocket | null = null
  private number = 0
  private readonly waiting = new Map<number, Waiting>()
  private delay = FIRST_DELAY_MS

  constructor(
    private readonly onEvent: (event: ServerEvent) => void,
    private readonly onFrame: (frame: ArrayBuffer) => void,
    private readonly onLine: (connected: boolean) => void,
  ) {}

  open(): void {
    const url = new URL('ws', location.href)
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:'
    const socket = new WebSocket(url)
    socket.binaryType = 'arraybuffer'
    this.socket = socket
    socket.onopen = () => {
      this.delay = FIRST_DELAY_MS
      this.onLine(true)
    }
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === 'string') this.receive(JSON.parse(data) as ServerEvent)
      else this.onFrame(data)
    }
    socket.onclose = () => {
      this.onLine(false)
      setTimeout(() => this.open(), this.delay)
      this.delay = Math.min(2 * this.delay, LONGEST_DELAY_MS)
    }
  }

  /** Ask the server for something; the promise fails with a Refusal. */
  ask<T = unknown>(request: Request): Promise<T> {
    const number = ++this.number
    return new Promise<T>((resolve, reject) => {
      this.waiting.set(number, { request, resolve: resolve as (value: unknown) => void, reject })
      this.send(number, request)
    })
  }

  /** Send again what has no answer yet: called once the documents are attached again. */
  resend(): void {
    for (const [number, { request }] of this.waiting) this.send(number, request)
  }

  private send(number: number, request: Request): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ number, request }))
  }

  private receive(event: ServerEvent): void {
    if (event.kind !== 'reply') {
      this.onEvent(event)
      return
    }
    const waiting = this.waiting.get(event.number)
    if (!waiting) return
    this.waiting.delete(event.number)
    const { fault } = event
    if (fault) waiting.reject(new Refusal(fault.what, fault.where, fault.allowed, fault.fix))
    else waiting.resolve(event.value)
  }
}
