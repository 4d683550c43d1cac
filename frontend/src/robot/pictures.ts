import type { WebGLRenderer } from 'three'

/** The renderer of a view and the function that draws one frame. */
export interface Rendering {
  gl: WebGLRenderer
  draw: () => void
}

const FRAMES_PER_SECOND = 30
const VIDEO_FORMATS = [
  'video/mp4;codecs=avc1',
  'video/webm;codecs=vp9',
  'video/webm;codecs=vp8',
  'video/webm',
]

function download(data: Blob, name: string): void {
  const link = document.createElement('a')
  link.href = URL.createObjectURL(data)
  link.download = name
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000)
}

/** Save the view as a PNG with at least two pixels per CSS px. */
export function savePicture(rendering: React.RefObject<Rendering | null>, name: string): void {
  const current = rendering.current
  if (!current) return
  const pixelRatio = current.gl.getPixelRatio()
  current.gl.setPixelRatio(Math.max(2, pixelRatio))
  current.draw()
  current.gl.domElement.toBlob((data) => {
    if (data) download(data, `${name}.png`)
    current.gl.setPixelRatio(pixelRatio)
    current.draw()
  }, 'image/png')
}

/** A video format that this browser can record; undefined if there is none. */
export function videoFormat(): string | undefined {
  return typeof MediaRecorder === 'undefined'
    ? undefined
    : VIDEO_FORMATS.find((format) => MediaRecorder.isTypeSupported(format))
}

/** Record a video of the view during a playback; the returned function ends it early. */
export function recordVideo(
  rendering: React.RefObject<Rendering | null>,
  name: string,
  play: () => Promise<void>,
  onEnd: () => void,
): () => void {
  const format = videoFormat()
  const canvas = rendering.current?.gl.domElement
  if (!format || !canvas) {
    onEnd()
    return () => {}
  }
  const recorder = new MediaRecorder(canvas.captureStream(FRAMES_PER_SECOND), {
    mimeType: format,
    videoBitsPerSecond: 8_000_000,
  })
  const parts: Blob[] = []
  recorder.ondataavailable = ({ data }) => void parts.push(data)
  recorder.onstop = () => {
    download(
      new Blob(parts, { type: format.split(';')[0]! }),
      `${name}.${format.includes('mp4') ? 'mp4' : 'webm'}`,
    )
    onEnd()
  }
  const stop = () => recorder.state !== 'inactive' && recorder.stop()
  recorder.start()
  void play().then(stop)
  return stop
}
