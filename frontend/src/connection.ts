import type { ReplyTo, Request, ServerEvent } from './messages'
import { keepUnsent, unsent } from './unsent'

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

/** `up`; `down`: no reply; `rejected`: the server replies but does not accept the session of this page. */
export type Line = 'up' | 'down' | 'rejected'

interface Waiting {
  request: Request
  resolve: (value: unknown) => void
  reject: (reason: Refusal) => void
}

const FIRST_DELAY_MS = 250
const LONGEST_DELAY_MS = 2000
/** Interval of the connection test, and time without a reply after which the connection counts as lost. */
const PING_MS = 1000
const SILENCE_MS = 2500
/** Time without a reply after which the connection is closed and opened again. */
const DEAD_MS = 10_000

/**
 * The websocket to the server. Requests without a reply are sent again after a reconnection, when the page
 * has its document again (`resend`), and also after a reload of the page. Edits carry keys, so the server
 * applies each of them once.
 */
export class Connection {
  private socket: WebSocket | null = null
  private number = 0
  private readonly waiting = new Map<number, Waiting>()
  private delay = FIRST_DELAY_MS
  /** Whether requests may be sent: not until the server has reopened the documents of this page. */
  private flowing = false
  private asked = 0
  private onEvent: (event: ServerEvent) => void = () => {}

  constructor(
    private readonly onFrame: (frame: ArrayBuffer) => void,
    private readonly onLine: (line: Line) => void,
    onRefused: (reason: Refusal) => void,
  ) {
    for (const request of unsent())
      this.waiting.set(++this.number, { request, resolve: () => {}, reject: onRefused })
    setInterval(() => this.listen(), PING_MS)
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
      this.delay = FIRST_DELAY_MS
      this.asked = 0
      this.onLine('up')
    }
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (this.silent()) this.onLine('up')
      this.asked = 0
      if (typeof data === 'string') this.receive(JSON.parse(data) as ServerEvent)
      else this.onFrame(data)
    }
    socket.onclose = () => {
      if (this.socket !== socket) return
      this.flowing = false
      this.forget('attach')
      void isRejected().then((rejected) => this.onLine(rejected ? 'rejected' : 'down'))
      setTimeout(() => this.connect(), this.delay)
      this.delay = Math.min(2 * this.delay, LONGEST_DELAY_MS)
    }
  }

  /** Test the connection; report a missing reply, and after a longer time reconnect. */
  private listen(): void {
    const { socket } = this
    if (socket?.readyState !== WebSocket.OPEN) return
    if (this.silent()) this.onLine('down')
    if (this.asked && performance.now() - this.asked > DEAD_MS) {
      socket.close()
      socket.onclose?.(new CloseEvent('close'))
      return
    }
    if (!this.asked) this.asked = performance.now()
    socket.send(JSON.stringify({ number: 0, request: { kind: 'ping' } }))
  }

  private silent(): boolean {
    return this.asked > 0 && performance.now() - this.asked > SILENCE_MS
  }

  private forget(kind: Request['kind']): void {
    for (const [number, { request }] of this.waiting) if (request.kind === kind) this.waiting.delete(number)
  }

  /** Send a request to the server; the promise is rejected with a Refusal. */
  ask<R extends Request>(request: R): Promise<ReplyTo<R>> {
    const number = ++this.number
    return new Promise<ReplyTo<R>>((resolve, reject) => {
      this.waiting.set(number, { request, resolve: resolve as (value: unknown) => void, reject })
      this.keep()
      if (this.flowing || request.kind === 'attach') this.send(number, request)
    })
  }

  /** Send requests again, first those without a reply; called when the page has its document again. */
  resend(): void {
    this.flowing = true
    for (const [number, { request }] of this.waiting) this.send(number, request)
  }

  private keep(): void {
    keepUnsent([...this.waiting.values()].map(({ request }) => request))
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
    this.keep()
    const { fault } = event
    if (fault) waiting.reject(new Refusal(fault.what, fault.where, fault.allowed, fault.fix))
    else waiting.resolve(event.value)
  }
}

/** Whether the server replies but rejects this page because it was restarted with a new login. */
async function isRejected(): Promise<boolean> {
  try {
    const answer = await fetch(new URL('index.html', location.href), { method: 'HEAD', cache: 'no-store' })
    return answer.status === 401
  } catch {
    return false
  }
}
