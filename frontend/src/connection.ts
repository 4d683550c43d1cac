import type { ReplyTo, Request, ServerEvent } from './messages'
import { storeUnsent, unsent } from './unsent'

/** The refusal of a request by the server, with the reason. */
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

/** `up`; `down`: no reply; `rejected`: the server replies but does not accept the session of this client. */
export type ConnectionState = 'up' | 'down' | 'rejected'

interface PendingRequest {
  request: Request
  resolve: (value: unknown) => void
  reject: (reason: Refusal) => void
}

const FIRST_DELAY_MS = 250
const MAX_DELAY_MS = 2000
/** Interval of the connection test, and time without a reply after which the connection counts as lost. */
const PING_MS = 1000
const REPLY_TIMEOUT_MS = 2500
/** Time without a reply after which the connection is closed and opened again. */
const RECONNECT_AFTER_MS = 10_000

/**
 * The websocket to the server. After a reconnection or a reload of the page, the server first reopens the
 * documents of the client. Then requests without a reply are sent again (`resend`). Edits carry keys, so the
 * server applies each of them once.
 */
export class Connection {
  private socket: WebSocket | null = null
  private lastNumber = 0
  private readonly pending = new Map<number, PendingRequest>()
  private reconnectDelay = FIRST_DELAY_MS
  /** Whether the server has reopened the documents of this client, so that requests may be sent. */
  private attached = false
  private pingedAt = 0
  private onEvent: (event: ServerEvent) => void = () => {}

  constructor(
    private readonly onFrame: (frame: ArrayBuffer) => void,
    private readonly onState: (state: ConnectionState) => void,
    onRefused: (reason: Refusal) => void,
  ) {
    for (const request of unsent())
      this.pending.set(++this.lastNumber, { request, resolve: () => {}, reject: onRefused })
    setInterval(() => this.checkConnection(), PING_MS)
  }

  /** Open the connection; `onEvent` receives the events of the server. */
  open(onEvent: (event: ServerEvent) => void): void {
    this.onEvent = onEvent
    this.connect()
  }

  private connect(): void {
    const url = new URL('ws', location.href)
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:'
    const socket = new WebSocket(url)
    socket.binaryType = 'arraybuffer'
    this.socket = socket
    socket.onopen = () => {
      this.reconnectDelay = FIRST_DELAY_MS
      this.pingedAt = 0
      this.onState('up')
    }
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (this.isSilent()) this.onState('up')
      this.pingedAt = 0
      if (typeof data === 'string') this.receive(JSON.parse(data) as ServerEvent)
      else this.onFrame(data)
    }
    socket.onclose = () => {
      if (this.socket !== socket) return
      this.attached = false
      this.dropPending('attach')
      void isRejected().then((rejected) => this.onState(rejected ? 'rejected' : 'down'))
      setTimeout(() => this.connect(), this.reconnectDelay)
      this.reconnectDelay = Math.min(2 * this.reconnectDelay, MAX_DELAY_MS)
    }
  }

  /** Test the connection; report a missing reply, and after a longer time reconnect. */
  private checkConnection(): void {
    const { socket } = this
    if (socket?.readyState !== WebSocket.OPEN) return
    if (this.isSilent()) this.onState('down')
    if (this.pingedAt && performance.now() - this.pingedAt > RECONNECT_AFTER_MS) {
      socket.close()
      socket.onclose?.(new CloseEvent('close'))
      return
    }
    if (!this.pingedAt) this.pingedAt = performance.now()
    socket.send(JSON.stringify({ number: 0, request: { kind: 'ping' } }))
  }

  private isSilent(): boolean {
    return this.pingedAt > 0 && performance.now() - this.pingedAt > REPLY_TIMEOUT_MS
  }

  private dropPending(kind: Request['kind']): void {
    for (const [number, { request }] of this.pending) if (request.kind === kind) this.pending.delete(number)
  }

  /** Send a request to the server; the promise is rejected with a Refusal. */
  ask<R extends Request>(request: R): Promise<ReplyTo<R>> {
    const number = ++this.lastNumber
    return new Promise<ReplyTo<R>>((resolve, reject) => {
      this.pending.set(number, { request, resolve: resolve as (value: unknown) => void, reject })
      this.storePending()
      if (this.attached || request.kind === 'attach') this.send(number, request)
    })
  }

  /** Send all requests without a reply; called when the server has reopened the documents of the client. */
  resend(): void {
    this.attached = true
    for (const [number, { request }] of this.pending) this.send(number, request)
  }

  private storePending(): void {
    storeUnsent([...this.pending.values()].map(({ request }) => request))
  }

  private send(number: number, request: Request): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ number, request }))
  }

  private receive(event: ServerEvent): void {
    if (event.kind !== 'reply') {
      this.onEvent(event)
      return
    }
    const request = this.pending.get(event.number)
    if (!request) return
    this.pending.delete(event.number)
    this.storePending()
    const { fault } = event
    if (fault) request.reject(new Refusal(fault.what, fault.where, fault.allowed, fault.fix))
    else request.resolve(event.value)
  }
}

/** Whether the server replies but rejects this client because it was restarted with a new login. */
async function isRejected(): Promise<boolean> {
  try {
    const response = await fetch(new URL('index.html', location.href), { method: 'HEAD', cache: 'no-store' })
    return response.status === 401
  } catch {
    return false
  }
}
