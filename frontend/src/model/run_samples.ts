import type { Channel } from '../protocol'
import { firstAfter } from './instants'

/** The columns of one signal in a frame. */
interface Columns {
  first: number
  count: number
  channel: Channel
}

/** One recorded signal: its channel, the sample times (s), and one typed array for each of its elements. */
export interface Signal {
  channel: Channel
  time: Float64Array
  columns: Float64Array[]
}

const FIRST_ROOM = 1024
let versions = 0

/**
 * The samples of one run, stored outside React because frames arrive faster than the page may render. In the
 * animation frame after a change, each view compares `version` with the version that it has drawn.
 */
export class RunSamples {
  version = ++versions
  count = 0
  /** Number of times that the run has stepped back. */
  returns = 0
  time = new Float64Array(FIRST_ROOM)
  private data: Float64Array[]
  private readonly columns = new Map<string, Columns>()

  constructor(
    readonly run: string,
    channels: Channel[],
    private readonly aliases: Record<string, string>,
  ) {
    let first = 0
    for (const channel of channels) {
      const count = channel.shape.reduce((product, n) => product * n, 1)
      this.columns.set(channel.name, { first, count, channel })
      first += count
    }
    this.data = Array.from({ length: first }, () => new Float64Array(FIRST_ROOM))
  }

  get bytes(): number {
    return 8 * this.time.length * (1 + this.data.length)
  }

  receive(frame: ArrayBuffer): void {
    const length = new DataView(frame).getUint32(0, true)
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(frame, 4, length))) as {
      run: string
      first: number
      count: number
    }
    if (header.run !== this.run) return
    const { first, count } = header
    this.reserve(first + count)
    let at = 4 + length
    this.time.set(new Float64Array(frame, at, count), first)
    for (const column of this.data) {
      at += 8 * count
      column.set(new Float64Array(frame, at, count), first)
    }
    this.count = first + count
    this.version = ++versions
  }

  /** Drop the samples after the first `count`, because the run has stepped back. */
  truncate(count: number): void {
    this.count = Math.min(this.count, count)
    this.returns++
    this.version = ++versions
  }

  /** Release unused memory when the run has ended. */
  close(): void {
    this.time = this.time.slice(0, this.count)
    this.data = this.data.map((column) => column.slice(0, this.count))
  }

  /** The display name of a signal: the name given by the user, or its block if that has no other output. */
  title(name: string): string {
    const given = this.columns.get(name)?.channel.title
    if (given) return given
    const block = name.slice(0, name.lastIndexOf('/'))
    return this.aliases[block] === name ? block : name
  }

  /** Names of all recorded signals. */
  get names(): string[] {
    return [...this.columns.keys()]
  }

  /** The signal with this name or alias. */
  signal(name: string): Signal | undefined {
    const found = this.columns.get(name) ?? this.columns.get(this.aliases[name] ?? '')
    if (!found) return undefined
    const columns = this.data.slice(found.first, found.first + found.count)
    return {
      channel: found.channel,
      time: this.time.subarray(0, this.count),
      columns: columns.map((column) => column.subarray(0, this.count)),
    }
  }

  /** Index of the last sample at or before a time (s); -1 if there is none. */
  indexAt(time: number): number {
    return firstAfter(this.time, time, this.count) - 1
  }

  private reserve(count: number): void {
    if (count <= this.time.length) return
    let size = Math.max(this.time.length, FIRST_ROOM)
    while (size < count) size *= 2
    const grown = (old: Float64Array) => {
      const column = new Float64Array(size)
      column.set(old)
      return column
    }
    this.time = grown(this.time)
    this.data = this.data.map(grown)
  }
}
