import { useCursor } from '../run/cursor'

const REST_DELAY_MS = 150

/**
 * One time cursor for all views of a result in the notebook. The views exchange the time without a kernel.
 * `onRest` receives the time when the cursor has stopped.
 */
export function shareCursor(onRest: (time: number) => void) {
  let channel: BroadcastChannel | null = null
  let receivedTime: number | null = null
  let sentTime: number | null = null
  let timer: ReturnType<typeof setTimeout> | undefined
  useCursor.subscribe(({ time }, before) => {
    if (time === null || time === before.time || time === receivedTime) return
    channel?.postMessage(time)
    clearTimeout(timer)
    timer = setTimeout(() => {
      sentTime = time
      onRest(time)
    }, REST_DELAY_MS)
  })
  const show = (time: number) => {
    if (time === sentTime) return // the echo of a sent time must not stop a slow playback
    receivedTime = time
    useCursor.setState({ time, playing: false })
  }
  return {
    show,
    join: (key: string) => {
      channel?.close()
      channel = new BroadcastChannel(`armblocks ${key}`)
      channel.onmessage = ({ data }: MessageEvent<number>) => show(data)
    },
  }
}
