/**
 * Scrolling of drop-down lists by the browser. Mantine's scroll area requests animation frames without end
 * if it is closed within 100 ms after scrolling, as in lists that scroll to the selected entry.
 */
export const SCROLLED = {
  withScrollArea: false,
  styles: { dropdown: { maxHeight: 220, overflowY: 'auto' } },
} as const
