/** The keys of one part of the page that are not commands, such as navigation keys. */
interface KeysOf {
  place: string
  /** The source files that handle these keys; a test compares them. */
  sources: string[]
  /** Key combinations, separated by a comma, and their effect. */
  keys: [ways: string, what: string][]
}

export const KEYS: KeysOf[] = [
  {
    place: 'On the sheet',
    sources: ['canvas/sheet_keys.ts'],
    keys: [
      ['letters', 'Add a block: type its name'],
      ['Tab', 'Go from block to block'],
      ['Enter', 'Open the block: its parameters, or the sheet inside; edit the note'],
      ['arrows', 'Move what is selected; with Shift by single pixels'],
      ['Del, Backspace', 'Delete blocks, wires and notes'],
      ['Esc', 'Clear the selection; again: leave the subsystem'],
      ['>', 'Draw a wire by the names of its ends'],
      ['"', 'Write a note'],
      ['Space', 'Fit the sheet into the window'],
      ['+, =', 'Zoom in'],
      ['-', 'Zoom out'],
      ['1', 'Show the sheet at 100 %'],
      ['?', 'This list'],
    ],
  },
  {
    place: 'With the mouse on the sheet',
    sources: [],
    keys: [
      ['Shift+drag', 'Disconnect a block and connect its neighbours'],
      ['Ctrl+drag', 'Duplicate the selected blocks at the pointer'],
      ['drag a corner', 'Resize the selected block'],
      ['drag from a port', 'Draw a wire; on the empty sheet add a block at its end'],
      ['double click', 'Open a block, or write its name; after a run show the chart of a scope'],
      ['double click on the empty sheet', 'Add a block'],
      ['middle button', 'Move the sheet'],
      ['Ctrl+wheel', 'Zoom'],
    ],
  },
  {
    place: 'Names and notes',
    sources: ['canvas/block_node.tsx', 'canvas/note_node.tsx'],
    keys: [
      ['Enter', 'Accept the name'],
      ['Ctrl+Enter', 'Accept the note'],
      ['Esc', 'Discard the change'],
    ],
  },
  {
    place: 'Lists, fields and the tour',
    sources: [
      'library/pick_list.tsx',
      'documents/open_dialog.tsx',
      'documents/tour.tsx',
      'scopes/inspector.tsx',
      'run/tune_panel.tsx',
      'robot/editor/joints_panel.tsx',
    ],
    keys: [
      ['↑, ↓', 'Move through the list'],
      ['Enter', 'Accept the selected or typed entry'],
      ['Esc', 'Close'],
    ],
  },
  {
    place: 'Time line',
    sources: ['run/timeline.tsx'],
    keys: [
      ['Space', 'Play or pause the playback'],
      ['arrows', 'One sample forward or back; with Shift ten'],
      ['Home, End', 'Go to the start or end of the run'],
    ],
  },
  {
    place: 'Scopes',
    sources: [],
    keys: [
      ['wheel', 'Zoom the time axis of all scopes; over the value axis zoom that scope\u2019s values'],
      ['drag', 'Pan the time axis; over the value axis pan the values'],
      ['Shift+drag', 'Move the time cursor'],
      ['double click', 'Show the whole run; on the value axis show all values'],
    ],
  },
  {
    place: 'Robot view',
    sources: ['robot/stage.tsx'],
    keys: [
      ['arrows', 'Turn the view'],
      ['+, =', 'Nearer'],
      ['-', 'Farther'],
      ['Home', 'From a corner'],
      ['Space', 'Show all of the arm'],
    ],
  },
  {
    place: 'Robot editor',
    sources: ['robot/editor/robot_editor.tsx', 'robot/editor/table.tsx'],
    keys: [
      ['Ctrl+S', 'Save the robot'],
      ['Ctrl+Z', 'Undo'],
      ['Ctrl+Y, Ctrl+Shift+Z', 'Redo'],
      ['↑, ↓', 'The same cell of the next or previous link'],
      ['Enter', 'Accept and go to the next link; with Shift to the previous link'],
      ['Esc', 'Discard the change of the cell'],
      ['?', 'This list'],
    ],
  },
]
