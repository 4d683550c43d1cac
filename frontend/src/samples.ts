import type { Channel } from './protocol'

/** Where the numbers of one signal lie among the columns of a frame. */
interface Columns {
  first: number
  count: number
  channel: Channel
}

/**
 * The samples of the run on the screen, outside of React: frames arrive faster than a page may render.
 * Every view draws from here on its own animation frame and compares `version` with what it drew last.
 */
class Samples {
  version = 0
  run = ''
  count = 0
  time = new Float64Array(0)
  private data: Float64Array[] = []
  private readonly columns = new Map<string, Columns>()
  private aliases: Record<string, string> = {}

  clear(): void {
    this.begin('', [], {})
  }

  begin(run: string, channels: Channel[], aliases: Record<string, string>): void {
    this.run = run
    this.count = 0
    this.time = new Float64Array(1024)
    this.columns.clear()
    this.aliases = aliases
    let first = 0
    for (const channel of channels) {
      const count = channel.shape.reduce((product, n) => product * n, 1)
      this.columns.set(channel.name, { first, count, channel })
      first += count
    }
    this.data = Array.from({ length: first }, () => new Float64Array(1024))
    this.version++
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
    this.version++
  }

  /** Only the first samples are still true: the run has gone back. */
  truncate(count: number): void {
    this.count = Math.min(this.count, count)
    this.version++
  }

  /** The signal of this name or alias: its channel and one typed array for each of its elements. */
  signal(name: string): { channel: Channel; columns: Float64Array[] } | undefined {
    const found = this.columns.get(name) ?? this.columns.get(this.aliases[name] ?? '')
    if (!found) return undefined
    const columns = this.data.slice(found.first, found.first + found.count)
    return { channel: found.channel, columns: columns.map((column) => column.subarray(0, this.count)) }
  }

  /** Index of the last sample at or before a time (s); -1 if there is none. */
  indexAt(time: number): number {
    let low = 0
    let high = this.count
    while (low < high) {
      const middle = (low + high) >> 1
      if ((this.time[middle] ?? Infinity) <= time) low = middle + 1
      else high = middle
    }
    return low - 1
  }

  private reserve(count: number): void {
    if (count <= this.time.length) return
    let size = this.time.length
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

export const samples = new Samples()
