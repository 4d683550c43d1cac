import { create } from 'zustand'

/**
 * The block that the pointer drags, or that was placed last. A wire is proposed for it. `at`: its position
 * during the drag, px.
 */
export const usePlaced = create<{ name: string; at: { x: number; y: number } | undefined }>(() => ({
  name: '',
  at: undefined,
}))

/** Propose no wire until the next block is placed. */
export const forgetPlaced = (): void => usePlaced.setState({ name: '', at: undefined })
