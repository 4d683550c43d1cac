import './subsystem_preview.css'
import { useComputedColorScheme } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useContextMenu } from '../context_menu_state'
import { useDialogs } from '../dialogs'
import { previewPlace, previewSize } from '../model/preview_place'
import { useStudio } from '../store'

/** Time that the pointer rests on a subsystem before its preview is shown. */
const POINTER_DELAY_MS = 700
/** The same delay for the keyboard focus, which moves from block to block. */
const FOCUS_DELAY_MS = 1000
/** The maximum size of the picture in the present window. */
const limit = () => ({ width: Math.max(360, 0.32 * innerWidth), height: Math.max(220, 0.38 * innerHeight) })

/** A small picture of the sheet inside the subsystem under the pointer or with the keyboard focus. */
export function SubsystemPreview() {
  const [name, setName] = useState<string | null>(null)
  useEffect(() => watchSubsystems(setName), [])
  const shown = useStudio((s) => (name !== null && s.document?.blocks[name]?.opens ? name : null))
  return shown === null ? null : <Preview key={shown} name={shown} close={() => setName(null)} />
}

/** Report the subsystem on which the pointer or the focus rests; `null` when it leaves, or at any input. */
function watchSubsystems(show: (name: string | null) => void): () => void {
  let timer = 0
  let waiting: string | null = null
  let isShown = false
  const close = () => {
    isShown = false
    clearTimeout(timer)
    waiting = null
    show(null)
  }
  const startTimer = (target: EventTarget | null, delay: number) => {
    const name = subsystemAt(target)
    if (name === waiting) return
    close()
    waiting = name
    if (name === null) return
    timer = window.setTimeout(() => {
      if (isBusy()) return
      isShown = true
      show(name)
    }, delay)
  }
  const listeners: Record<string, (event: Event) => void> = {
    pointerover: (event) => {
      const { buttons, pointerType } = event as PointerEvent
      if (buttons || pointerType === 'touch') close()
      else startTimer(event.target, POINTER_DELAY_MS)
    },
    focusin: ({ target }) => {
      if (target instanceof Element && target.matches(':focus-visible')) startTimer(target, FOCUS_DELAY_MS)
    },
    pointerout: (event) => {
      if ((event as PointerEvent).relatedTarget === null) close() // the pointer has left the window
    },
    keydown: (event) => {
      // Escape closes the preview only; the selection and the sheet remain.
      if (isShown && (event as KeyboardEvent).key === 'Escape') event.stopPropagation()
      close()
    },
    focusout: close,
    pointerdown: close,
    wheel: close,
  }
  const names = Object.keys(listeners)
  for (const name of names)
    document.addEventListener(name, listeners[name]!, { capture: true, passive: true })
  return () => {
    clearTimeout(timer)
    for (const name of names) document.removeEventListener(name, listeners[name]!, true)
  }
}

/** The subsystem to which an element of the sheet belongs. */
function subsystemAt(target: EventTarget | null): string | null {
  const name =
    target instanceof Element && target.closest('.canvas .react-flow__node')?.getAttribute('data-id')
  return name && useStudio.getState().document?.blocks[name]?.opens ? name : null
}

const isBusy = () =>
  useDialogs.getState().open !== null ||
  useStudio.getState().editing !== null ||
  useContextMenu.getState().opened ||
  document.activeElement instanceof HTMLInputElement ||
  document.activeElement instanceof HTMLTextAreaElement

/** The bounds of a block and its name. */
function boundsOf(block: Element) {
  const { x, y, right, bottom } = block.getBoundingClientRect()
  const name = block.querySelector('.name.below')?.getBoundingClientRect()
  return { x, y, width: right - x, height: Math.max(bottom, name?.bottom ?? 0) - y }
}

function Preview({ name, close }: { name: string; close: () => void }) {
  const theme = useComputedColorScheme('light')
  const state = useStudio((s) => s.document!.state)
  const inside = useStudio((s) => s.document!.inside)
  const [size, setSize] = useState<{ width: number; height: number } | null>(null)
  const block = document.querySelector(`.canvas .react-flow__node[data-id="${CSS.escape(name)}"]`)
  if (!block) return null
  const query = new URLSearchParams({
    sheet: [...inside, name].join('/'),
    theme,
    version: String(state.version),
  })
  const frame = { width: innerWidth, height: innerHeight }
  const box = size && { width: size.width + 18, height: size.height + 36 }
  return (
    <figure
      className="subsystem-preview"
      style={box ? { ...previewPlace(boundsOf(block), box, frame), width: box.width } : { opacity: 0 }}
      aria-hidden
    >
      <figcaption>{name}</figcaption>
      <img
        src={`drawing/${state.document}.svg?${query}`}
        alt=""
        style={size ?? undefined}
        onLoad={({ currentTarget: { naturalWidth, naturalHeight } }) => {
          const picture = { width: naturalWidth || limit().width, height: naturalHeight || limit().height }
          setSize(previewSize(picture, limit()))
        }}
        onError={close}
      />
    </figure>
  )
}
