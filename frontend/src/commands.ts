import { align, comment, distribute, flip, ground, group, rotate, chosenBlocks } from './canvas/arranging'
import { rename } from './canvas/block_node'
import { copy, cut, duplicate, paste } from './canvas/clipboard'
import { addNote, sheetView, ZOOM_STEP } from './canvas/sheet_actions'
import { openConfiguration, openMask, openTour, save, show } from './dialogs'
import { exportDrawing, openReport } from './documents/export'
import { control, startOrResume } from './run/start'
import { alter, ask, change, look, useStudio } from './store'
import { setTheme } from './theme'

/** A command: shown in the command palette and in the list of keys, and executed by its key. */
export interface Command {
  title: string
  /** Key combination, `Ctrl+Shift+G`; alternatives separated by a comma. */
  keys?: string
  /** Whether the key is active only while the sheet has the focus. */
  onSheet?: boolean
  /** Whether text fields handle this key themselves. */
  fieldsOwn?: boolean
  /** Whether the command is available now; by default always. */
  possible?: () => boolean
  run: () => void
}

const selected = () => useStudio.getState().selection.size > 0
const chosen = () => chosenBlocks().length > 0
const several = () => chosenBlocks().length > 1
const masked = () => chosenBlocks().find(({ opens }) => opens)
const ran = () => useStudio.getState().run !== null

/** Every command, in the order of the palette. */
export function commands(): Command[] {
  return LIST
}

const LIST: Command[] = [
  { title: 'Run or continue', keys: 'Ctrl+Enter', run: startOrResume },
  { title: 'Pause the run', keys: 'Ctrl+.', possible: ran, run: () => control('pause') },
  { title: 'Stop the run', keys: 'Ctrl+Shift+Enter', possible: ran, run: () => control('stop') },
  {
    title: 'Step forward',
    keys: 'Ctrl+→',
    fieldsOwn: true,
    possible: ran,
    run: () => control('step'),
  },
  { title: 'Step back', keys: 'Ctrl+←', fieldsOwn: true, possible: ran, run: () => control('back') },
  { title: 'Find blocks, types and values', keys: 'Ctrl+F', run: () => show('find') },
  { title: 'Add a block', run: () => show('insert') },
  { title: 'Draw a wire by the names of its ends', keys: '>', run: () => show('connect') },
  { title: 'Write a note', keys: '"', run: addNote },
  { title: 'Undo', keys: 'Ctrl+Z', fieldsOwn: true, run: () => alter('undo') },
  { title: 'Redo', keys: 'Ctrl+Y, Ctrl+Shift+Z', fieldsOwn: true, run: () => alter('redo') },
  { title: 'Save', keys: 'Ctrl+S', run: () => void save() },
  { title: 'Save under another name', keys: 'Ctrl+Shift+S', run: () => show('save_as') },
  { title: 'Open', keys: 'Ctrl+O', run: () => show('open') },
  { title: 'New diagram', run: () => void ask({ kind: 'new', document_kind: 'diagram' }) },
  { title: 'Group into a subsystem', keys: 'Ctrl+G', onSheet: true, possible: chosen, run: group },
  {
    title: 'Edit the mask: parameters of the subsystem or the model',
    keys: 'Ctrl+M',
    onSheet: true,
    possible: () => !useStudio.getState().document?.linked.length && !masked()?.link,
    run: () => openMask(masked()?.name),
  },
  {
    title: 'Rename',
    keys: 'F2',
    onSheet: true,
    possible: chosen,
    run: () => rename(chosenBlocks()[0]!.name),
  },
  { title: 'Rotate', keys: 'Ctrl+R', onSheet: true, possible: chosen, run: rotate },
  { title: 'Flip', keys: 'Ctrl+I', onSheet: true, possible: chosen, run: flip },
  {
    title: 'Comment out, or uncomment',
    keys: 'Ctrl+Shift+X',
    onSheet: true,
    possible: chosen,
    run: () => comment('out'),
  },
  {
    title: 'Comment through, or uncomment',
    keys: 'Ctrl+Shift+Y',
    onSheet: true,
    possible: chosen,
    run: () => comment('through'),
  },
  { title: 'Ground and terminate unconnected ports', run: ground },
  { title: 'Duplicate', keys: 'Ctrl+D', onSheet: true, possible: selected, run: () => void duplicate() },
  { title: 'Copy', keys: 'Ctrl+C', onSheet: true, possible: selected, run: () => void copy() },
  { title: 'Cut', keys: 'Ctrl+X', onSheet: true, possible: selected, run: () => void cut() },
  { title: 'Paste', keys: 'Ctrl+V', onSheet: true, run: () => void paste() },
  {
    title: 'Select all',
    keys: 'Ctrl+A',
    onSheet: true,
    run: () => {
      const { document, select } = useStudio.getState()
      select([...Object.keys(document?.blocks ?? {}), ...Object.keys(document?.notes ?? {})])
    },
  },
  { title: 'Align left edges', possible: several, run: () => align('left') },
  { title: 'Align centres', possible: several, run: () => align('centre') },
  { title: 'Align right edges', possible: several, run: () => align('right') },
  { title: 'Align top edges', possible: several, run: () => align('top') },
  { title: 'Align middles', possible: several, run: () => align('middle') },
  { title: 'Align bottom edges', possible: several, run: () => align('bottom') },
  { title: 'Equal gaps from left to right', possible: several, run: () => distribute('x') },
  { title: 'Equal gaps from top to bottom', possible: several, run: () => distribute('y') },
  { title: 'Arrange the sheet', run: () => void change({ kind: 'arrange' }) },
  { title: 'Fit the sheet into the window', keys: 'Space', run: () => sheetView.fit?.() },
  { title: 'Zoom in', keys: '+', run: () => sheetView.zoom?.(ZOOM_STEP) },
  { title: 'Zoom out', keys: '-', run: () => sheetView.zoom?.(1 / ZOOM_STEP) },
  { title: 'Show the sheet at 100 %', keys: '1', run: () => sheetView.zoom?.(null) },
  { title: 'Light theme', run: () => setTheme('light') },
  { title: 'Dark theme', run: () => setTheme('dark') },
  { title: 'Theme of the system', run: () => setTheme('auto') },
  {
    title: 'Leave the subsystem',
    keys: 'Esc',
    possible: () => Boolean(useStudio.getState().document?.inside.length),
    run: () => look(useStudio.getState().document!.inside.slice(0, -1)),
  },
  { title: 'Report of this run', possible: ran, run: openReport },
  { title: 'Export the sheet as SVG', run: () => exportDrawing('svg') },
  { title: 'Export the sheet as PNG', run: () => exportDrawing('png') },
  { title: 'Export the sheet as PDF', run: () => exportDrawing('pdf') },
  { title: 'Configuration parameters', keys: 'Ctrl+E', run: openConfiguration },
  { title: 'Take the tour', run: openTour },
  { title: 'All commands by name', keys: 'Ctrl+K', run: () => show('commands') },
  { title: 'All keys', keys: '?', run: () => show('keys') },
]

const ARROWS: Record<string, string> = { '→': 'arrowright', '←': 'arrowleft' }

/** Whether exactly these keys are pressed, all of them with Ctrl. */
function pressed(keys: string, event: KeyboardEvent): boolean {
  return keys.split(', ').some((way) => {
    const parts = way.split('+')
    const key = parts.at(-1)!.toLowerCase()
    return (
      parts.includes('Ctrl') &&
      (event.ctrlKey || event.metaKey) &&
      event.shiftKey === parts.includes('Shift') &&
      event.key.toLowerCase() === (ARROWS[key] ?? key)
    )
  })
}

/** The command for the pressed keys, among the commands of the sheet or among all others. */
export function commandOf(event: KeyboardEvent, ofSheet: boolean): Command | undefined {
  const typing = event.target instanceof Element && event.target.closest('input, textarea') !== null
  return LIST.find(
    ({ keys, onSheet = false, fieldsOwn = false }) =>
      keys && onSheet === ofSheet && !(fieldsOwn && typing) && pressed(keys, event),
  )
}
