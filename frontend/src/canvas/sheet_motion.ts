import { useStoreApi, type Viewport } from '@xyflow/react'
import { createContext, useEffect, useState, type RefObject } from 'react'

/** Time without a change of the view after which a motion has ended, ms. */
const REST_MS = 150
/** Number of blocks above which a sheet is moved as one layer and has a map. */
const MANY_BLOCKS = 40
/** Distance by which the pointer may be moved during a motion, px. */
const POINTER_REST_PX = 4
/** Events that end a motion, because their handlers use the present view. */
const ENDING_EVENTS = ['keydown', 'dragenter', 'pagehide'] as const

/** The motion of the sheet that contains a component. */
export const MotionContext = createContext<SheetMotion | null>(null)

/** Panning and zooming of the visible sheet. */
export function useSheetMotion(
  sheet: RefObject<HTMLDivElement | null>,
  blockCount: number,
  initialView: Viewport | undefined,
): SheetMotion {
  const store = useStoreApi()
  const [motion] = useState(() => new SheetMotion(store, initialView))
  motion.isLarge = blockCount > MANY_BLOCKS
  useEffect(() => {
    const element = sheet.current!
    motion.sheet = element
    const begin = (event: WheelEvent) => !event.buttons && motion.begin()
    element.addEventListener('wheel', begin, { capture: true, passive: true })
    addEventListener('pointermove', motion.onPointer, true)
    addEventListener('pointerdown', motion.onPress, true)
    for (const kind of ENDING_EVENTS) addEventListener(kind, motion.end, true)
    return () => {
      motion.end()
      element.removeEventListener('wheel', begin, true)
      removeEventListener('pointermove', motion.onPointer, true)
      removeEventListener('pointerdown', motion.onPress, true)
      for (const kind of ENDING_EVENTS) removeEventListener(kind, motion.end, true)
    }
  }, [sheet, motion])
  return motion
}

/** Dispatch a pointer event again at the element below the pointer, if this is not the event's target. */
function redirect(event: MouseEvent): void {
  const target = document.elementFromPoint(event.clientX, event.clientY)
  if (!event.isTrusted || !target || target === event.target) return
  event.stopImmediatePropagation()
  target.dispatchEvent(new (event.constructor as typeof MouseEvent)(event.type, event))
}

/** Return the focus to an element; listeners do not treat this as a focus that the user has moved. */
function refocus(element: HTMLOrSVGElement): void {
  const stop = (event: FocusEvent) => event.stopImmediatePropagation()
  addEventListener('focusin', stop, true)
  element.focus({ preventScroll: true })
  removeEventListener('focusin', stop, true)
}

/**
 * The view of a sheet. While a large sheet is panned or zoomed, the browser moves its picture as one layer,
 * and React Flow receives the view when the motion has ended: for every view that it receives, it computes
 * the ports and wires of all blocks again. React Flow receives all other views at once.
 */
export class SheetMotion {
  /** The present view. Changes modify this object; React Flow treats the view as a controlled property. */
  readonly view: Viewport
  isLarge = false
  /** Whether a picture replaces the sheet during a motion. */
  hasPicture = false
  sheet: HTMLElement | null = null
  private layer: HTMLElement | null = null
  /** The timer of the end of the motion; 0: there is no motion. */
  private timer = 0
  /** The position of the pointer, and that at the start of the motion, px. */
  private pointer: readonly [number, number] = [0, 0]
  private pointerAtStart: readonly [number, number] = [0, 0]
  /** The element of the sheet with the focus: it loses the focus while a picture replaces the sheet. */
  private focused: (Element & HTMLOrSVGElement) | null = null
  /** The number of motions until now. */
  count = 0
  private readonly store
  private readonly listeners = new Set<() => void>()

  constructor(store: ReturnType<typeof useStoreApi>, view: Viewport = { x: 0, y: 0, zoom: 1 }) {
    this.store = store
    this.view = { ...view }
  }

  /** Call a function after every change of the view. Returns a function that stops these calls. */
  readonly onView = (listener: () => void): (() => void) => {
    this.listeners.add(listener)
    return () => this.listeners.delete(listener)
  }

  /** Whether a picture replaces the sheet at present. */
  get isPictured(): boolean {
    return this.sheet?.classList.contains('pictured') ?? false
  }

  /** End the motion when the pointer moves without a pressed button, so that elements below it get events. */
  readonly onPointer = ({ clientX, clientY, buttons }: PointerEvent): void => {
    this.pointer = [clientX, clientY]
    const [x, y] = this.pointerAtStart
    if (this.timer && !buttons && Math.hypot(clientX - x, clientY - y) > POINTER_REST_PX) this.end()
  }

  /** End the motion at a press, which belongs to the element that the picture of the sheet has covered. */
  readonly onPress = (event: PointerEvent): void => {
    if (!this.timer) return
    this.end()
    redirect(event)
    addEventListener('mousedown', redirect, { capture: true, once: true })
  }

  /** Start or continue a motion. */
  begin(): void {
    if (!this.isLarge || !this.sheet) return
    if (!this.timer) {
      this.layer = this.sheet.querySelector<HTMLElement>('.react-flow__viewport')
      this.sheet.classList.add('moving')
      this.focused = this.layer?.querySelector<HTMLElement>(':focus') ?? null
      this.pointerAtStart = this.pointer
      this.count++
    }
    clearTimeout(this.timer)
    this.timer = window.setTimeout(this.endAfterFrames, REST_MS)
  }

  /** Show a view. */
  readonly change = (view: Viewport): void => {
    Object.assign(this.view, view)
    if (this.timer || this.store.getState().paneDragging) this.begin()
    if (this.timer) this.move()
    else this.commit()
    for (const listener of this.listeners) listener()
  }

  /** End the motion. */
  readonly end = (): void => {
    if (!this.timer) return
    clearTimeout(this.timer)
    this.timer = 0
    this.sheet!.classList.remove('moving', 'pictured')
    this.commit()
    if (this.focused?.isConnected && document.activeElement === document.body) refocus(this.focused)
    this.focused = null
  }

  /** End the motion if it does not continue after the next frames, which can take longer than the timer. */
  private readonly endAfterFrames = (): void => {
    const { timer } = this
    const endIfUnchanged = () => setTimeout(() => this.timer === timer && this.end())
    requestAnimationFrame(() => requestAnimationFrame(endIfUnchanged))
  }

  /** Move the layer; a picture replaces the sheet, unless the user types text on the sheet. */
  private move(): void {
    const { x, y, zoom } = this.view
    this.layer!.style.transform = `translate(${x}px,${y}px) scale(${zoom})`
    if (this.hasPicture && !this.focused?.matches('input, textarea')) this.sheet!.classList.add('pictured')
  }

  private commit(): void {
    const { x, y, zoom } = this.view
    this.store.setState({ transform: [x, y, zoom] })
  }
}
