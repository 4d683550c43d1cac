import { align, comment, distribute, flip, ground, group, rotate, selectedBlocks } from './canvas/arranging'
import { rename } from './canvas/block_node'
import { copy, cut, duplicate, paste } from './canvas/clipboard'
import { addNote, sheetView, showSelection, ZOOM_STEP } from './canvas/sheet_actions'
import {
  openBookmarks,
  openConfiguration,
  openMask,
  openParameterSets,
  openTour,
  save,
  showDialog,
} from './dialogs'
import { exportDrawing, openReport } from './documents/export'
import { canClose, canStepTabs, closeInFront, stepTabs } from './documents/tabs'
import { control, startOrResume } from './run/start'
import { arePressed } from './model/key_combinations'
import { alterDocument, ask, change, openSheet, useStudio } from './store'
import { setTheme } from './theme'

/** A command: shown in the command palette and in the list of keys, and executed by its key. */
export interface Command {
  title: string
  /** Key combination, `Ctrl+Shift+G`; alternatives separated by a comma. */
  keys?: string
  /** Whether the key is active only while the sheet has the focus. */
  sheetOnly?: boolean
  /** Whether the key is also active in the robot editor, which has its own keys. */
  inRobotEditor?: boolean
  /** Whether text fields handle this key themselves. */
  handledByFields?: boolean
  /** Whether the command is available now; by default always. */
  enabled?: () => boolean
  run: () => void
}

const hasSelection = () => useStudio.getState().selection.size > 0
const hasBlocks = () => selectedBlocks().length > 0
const hasSeveralBlocks = () => selectedBlocks().length > 1
const selectedSubsystem = () => selectedBlocks().find(({ opens }) => opens)
const hasRun = () => useStudio.getState().run !== null

/** Every command, in the order of the palette. */
export function commands(): Command[] {
  return COMMANDS
}

const COMMANDS: Command[] = [
  { title: 'Run or continue', keys: 'Ctrl+Enter', run: startOrResume },
  { title: 'Pause the run', keys: 'Ctrl+.', enabled: hasRun, run: () => control('pause') },
  { title: 'Stop the run', keys: 'Ctrl+Shift+Enter', enabled: hasRun, run: () => control('stop') },
  {
    title: 'Step forward',
    keys: 'Ctrl+→',
    handledByFields: true,
    enabled: hasRun,
    run: () => control('step'),
  },
  { title: 'Step back', keys: 'Ctrl+←', handledByFields: true, enabled: hasRun, run: () => control('back') },
  { title: 'Find blocks, types, values and bookmarks', keys: 'Ctrl+F', run: () => showDialog('find') },
  { title: 'Add a block', run: () => showDialog('insert') },
  { title: 'Draw a wire by the names of its ports', keys: '>', run: () => showDialog('connect') },
  { title: 'Write a note', keys: '"', run: addNote },
  { title: 'Undo', keys: 'Ctrl+Z', handledByFields: true, run: () => alterDocument('undo') },
  { title: 'Redo', keys: 'Ctrl+Y, Ctrl+Shift+Z', handledByFields: true, run: () => alterDocument('redo') },
  { title: 'Save', keys: 'Ctrl+S', run: () => void save() },
  { title: 'Save under another name', keys: 'Ctrl+Shift+S', run: () => showDialog('save_as') },
  { title: 'Open', keys: 'Ctrl+O', run: () => showDialog('open') },
  { title: 'New diagram', run: () => void ask({ kind: 'new', document_kind: 'diagram' }) },
  {
    title: 'Next document',
    keys: 'Alt+PageDown',
    inRobotEditor: true,
    enabled: canStepTabs,
    run: () => stepTabs(1),
  },
  {
    title: 'Previous document',
    keys: 'Alt+PageUp',
    inRobotEditor: true,
    enabled: canStepTabs,
    run: () => stepTabs(-1),
  },
  { title: 'Close the document', keys: 'Alt+W', inRobotEditor: true, enabled: canClose, run: closeInFront },
  { title: 'Group into a subsystem', keys: 'Ctrl+G', sheetOnly: true, enabled: hasBlocks, run: group },
  {
    title: 'Edit the mask: parameters of the subsystem or the model',
    keys: 'Ctrl+M',
    sheetOnly: true,
    enabled: () => !useStudio.getState().document?.linked.length && !selectedSubsystem()?.link,
    run: () => openMask(selectedSubsystem()?.name),
  },
  {
    title: 'Rename',
    keys: 'F2',
    sheetOnly: true,
    enabled: hasBlocks,
    run: () => rename(selectedBlocks()[0]!.name),
  },
  { title: 'Rotate', keys: 'Ctrl+R', sheetOnly: true, enabled: hasBlocks, run: rotate },
  { title: 'Flip', keys: 'Ctrl+I', sheetOnly: true, enabled: hasBlocks, run: flip },
  {
    title: 'Comment out, or uncomment',
    keys: 'Ctrl+Shift+X',
    sheetOnly: true,
    enabled: hasBlocks,
    run: () => comment('out'),
  },
  {
    title: 'Comment through, or uncomment',
    keys: 'Ctrl+Shift+Y',
    sheetOnly: true,
    enabled: hasBlocks,
    run: () => comment('through'),
  },
  { title: 'Ground and terminate unconnected ports', run: ground },
  {
    title: 'Delete and connect the neighbours',
    keys: 'Ctrl+Delete, Ctrl+Backspace',
    sheetOnly: true,
    enabled: hasBlocks,
    run: () => void import('./canvas/selected_connections').then((actions) => actions.removeAndReconnect()),
  },
  { title: 'Duplicate', keys: 'Ctrl+D', sheetOnly: true, enabled: hasSelection, run: () => void duplicate() },
  { title: 'Copy', keys: 'Ctrl+C', sheetOnly: true, enabled: hasSelection, run: () => void copy() },
  { title: 'Cut', keys: 'Ctrl+X', sheetOnly: true, enabled: hasSelection, run: () => void cut() },
  { title: 'Paste', keys: 'Ctrl+V', sheetOnly: true, run: () => void paste() },
  {
    title: 'Select all',
    keys: 'Ctrl+A',
    sheetOnly: true,
    run: () => {
      const { document, select } = useStudio.getState()
      select([...Object.keys(document?.blocks ?? {}), ...Object.keys(document?.notes ?? {})])
    },
  },
  { title: 'Align left edges', enabled: hasSeveralBlocks, run: () => align('left') },
  { title: 'Align centres', enabled: hasSeveralBlocks, run: () => align('centre') },
  { title: 'Align right edges', enabled: hasSeveralBlocks, run: () => align('right') },
  { title: 'Align top edges', enabled: hasSeveralBlocks, run: () => align('top') },
  { title: 'Align middles', enabled: hasSeveralBlocks, run: () => align('middle') },
  { title: 'Align bottom edges', enabled: hasSeveralBlocks, run: () => align('bottom') },
  { title: 'Equal gaps from left to right', enabled: hasSeveralBlocks, run: () => distribute('x') },
  { title: 'Equal gaps from top to bottom', enabled: hasSeveralBlocks, run: () => distribute('y') },
  { title: 'Arrange the sheet', run: () => void change({ kind: 'arrange' }) },
  { title: 'Fit the sheet into the window', keys: 'Space', run: () => sheetView.fit?.() },
  { title: 'Zoom in', keys: '+', run: () => sheetView.zoom?.(ZOOM_STEP) },
  { title: 'Zoom out', keys: '-', run: () => sheetView.zoom?.(1 / ZOOM_STEP) },
  { title: 'Show the sheet at 100 %', keys: '1', run: () => sheetView.zoom?.(null) },
  { title: 'Zoom to the selection', keys: '2', run: showSelection },
  { title: 'Bookmark this view', keys: 'Ctrl+B', run: () => openBookmarks('add') },
  { title: 'Bookmarks of views', keys: 'Ctrl+Shift+B', run: () => openBookmarks() },
  { title: 'Light theme', run: () => setTheme('light') },
  { title: 'Dark theme', run: () => setTheme('dark') },
  { title: 'Theme of the system', run: () => setTheme('auto') },
  {
    title: 'Leave the subsystem',
    keys: 'Esc',
    enabled: () => Boolean(useStudio.getState().document?.inside.length),
    run: () => openSheet(useStudio.getState().document!.inside.slice(0, -1)),
  },
  { title: 'Report of this run', enabled: hasRun, run: openReport },
  { title: 'Export the sheet as SVG', run: () => exportDrawing('svg') },
  { title: 'Export the sheet as PNG', run: () => exportDrawing('png') },
  { title: 'Export the sheet as PDF', run: () => exportDrawing('pdf') },
  { title: 'Configuration parameters', keys: 'Ctrl+E', run: openConfiguration },
  {
    title: 'Trigger of the scopes, on or off',
    enabled: hasRun,
    run: () => void import('./scopes/trigger').then(({ toggleTrigger }) => toggleTrigger()),
  },
  { title: 'Parameter sets: save, apply and compare', run: openParameterSets },
  { title: 'Take the tour', run: openTour },
  { title: 'All commands by name', keys: 'Ctrl+K', run: () => showDialog('commands') },
  { title: 'All keys', keys: '?', run: () => showDialog('keys') },
  { title: 'Print the list of keys', run: () => showDialog('keys', 'print') },
]

/** The command for the pressed keys, among the commands of the sheet or among all other commands. */
export function commandOf(event: KeyboardEvent, ofSheet: boolean): Command | undefined {
  const typing = event.target instanceof Element && event.target.closest('input, textarea') !== null
  return COMMANDS.find(
    ({ keys, sheetOnly = false, handledByFields = false }) =>
      keys && sheetOnly === ofSheet && !(handledByFields && typing) && arePressed(keys, event),
  )
}
