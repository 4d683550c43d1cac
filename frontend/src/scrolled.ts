/**
 * How a list that drops down is scrolled: by the browser. Mantine's own scroll area asks for every animation
 * frame for ever where it is closed within 100 ms of its last scrolling, which lists do that scroll to what
 * is chosen.
 */
export const SCROLLED = {
  withScrollArea: false,
  styles: { dropdown: { maxHeight: 220, overflowY: 'auto' } },
} as const
