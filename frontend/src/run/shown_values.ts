import { create } from 'zustand'
import { scheduleFrame } from '../frames'

interface ShownValues {
  /** Whether the values of all outputs are displayed. */
  all: boolean
  /** Outputs, `block/port` with the path of their sheet, whose values are pinned. */
  pinned: ReadonlySet<string>
}

/** The values shown on wires; a wire under the pointer always shows its value. */
export const useShownValues = create<ShownValues>(() => ({ all: false, pinned: new Set() }))
useShownValues.subscribe(scheduleFrame)
