import type { Channel } from '../protocol'
import { pathAfter, withKeysAfter, type Renamed } from './renames'
import { firstAfter } from './time_index'

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

const INITIAL_CAPACITY = 1024
let lastVersion = 0

/**
 * The samples of one run, stored outside React because frames arrive faster than the front end may render. In
 * the animation frame after a change, each view compares `version` with the version that it has drawn.
 */
export class RunSamples {
  version = ++lastVersion
  count = 0
  /** Number of times that the run has stepped back. */
  stepBacks = 0
  time = new Float64Array(INITIAL_CAPACITY)
  private data: Float64Array[]
  private columns = new Map<string, Columns>()

  constructor(
    readonly run: string,
    channels: Channel[],
    private aliases: Record<string, string>,
  ) {
    const first = this.name(channels, aliases)
    this.data = Array.from({ length: first }, () => new Float64Array(INITIAL_CAPACITY))
  }

  /** Set the names of the signals; returns the number of columns. */
  name(channels: Channel[], aliases: Record<string, string>): number {
    this.aliases = aliases
    this.columns = new Map()
    let first = 0
    for (const channel of channels) {
      const count = channel.shape.reduce((product, n) => product * n, 1)
      this.columns.set(channel.name, { first, count, channel })
      first += count
    }
    return first
  }

  /** Give the signals of renamed blocks their new names. */
  rename(renamed: Renamed): void {
    const channels = [...this.columns.values()].map(({ channel }) => ({
      ...channel,
      name: pathAfter(channel.name, renamed),
    }))
    const aliases = Object.entries(withKeysAfter(this.aliases, renamed))
    this.name(channels, Object.fromEntries(aliases.map(([alias, name]) => [alias, pathAfter(name, renamed)])))
    this.version = ++lastVersion
  }

  get bytes(): number {
    return 8 * this.time.length * (1 + this.data.length)
  }

  /** Add a frame; returns whether it belongs to this run. */
  receive(frame: ArrayBuffer): boolean {
    const length = new DataView(frame).getUint32(0, true)
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(frame, 4, length))) as {
      run: string
      first: number
      count: number
    }
    if (header.run !== this.run) return false
    const { first, count } = header
    this.reserve(first + count)
    let offset = 4 + length
    this.time.set(new Float64Array(frame, offset, count), first)
    for (const column of this.data) {
      offset += 8 * count
      column.set(new Float64Array(frame, offset, count), first)
    }
    this.count = first + count
    this.version = ++lastVersion
    return true
  }

  /** Drop the samples after the first `count`, because the run has stepped back. */
  truncate(count: number): void {
    this.count = Math.min(this.count, count)
    this.stepBacks++
    this.version = ++lastVersion
  }

  /** Release unused memory when the run has ended. */
  close(): void {
    this.time = this.time.slice(0, this.count)
    this.data = this.data.map((column) => column.slice(0, this.count))
  }

  /** The display name of a signal: the name given by the user, or its block if that has no other output. */
  title(name: string): string {
    const userTitle = this.columns.get(name)?.channel.title
    if (userTitle) return userTitle
    const block = name.slice(0, name.lastIndexOf('/'))
    return this.aliases[block] === name ? block : name
  }

  /** Names of all recorded signals. */
  get names(): string[] {
    return [...this.columns.keys()]
  }

  /** The signal with this name or alias. */
  signal(name: string): Signal | undefined {
    const columnsOfSignal = this.columns.get(name) ?? this.columns.get(this.aliases[name] ?? '')
    if (!columnsOfSignal) return undefined
    const columns = this.data.slice(columnsOfSignal.first, columnsOfSignal.first + columnsOfSignal.count)
    return {
      channel: columnsOfSignal.channel,
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
    let capacity = Math.max(this.time.length, INITIAL_CAPACITY)
    while (capacity < count) capacity *= 2
    const enlarged = (old: Float64Array) => {
      const column = new Float64Array(capacity)
      column.set(old)
      return column
    }
    this.time = enlarged(this.time)
    this.data = this.data.map(enlarged)
  }
}
