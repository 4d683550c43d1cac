/** The keys of one place of the page that are no commands: how one moves about there. */
interface KeysOf {
  place: string
  /** The sources whose keys these are: a test compares them. */
  sources: string[]
  /** Ways to press, apart by a comma, and what they do. */
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
      ['Esc', 'Select nothing; then out of the subsystem'],
      ['>', 'Draw a wire by the names of its ends'],
      ['"', 'Write a note'],
      ['Space', 'Fit the sheet into the window'],
      ['?', 'This list'],
    ],
  },
  {
    place: 'With the mouse on the sheet',
    sources: [],
    keys: [
      ['Shift+drag', 'Take a block out of its wires, which close behind it'],
      ['double click', 'Open a block or write its name; on the empty sheet add a block'],
      ['middle button', 'Move the sheet'],
      ['Ctrl+wheel', 'Nearer and farther'],
    ],
  },
  {
    place: 'Names and notes',
    sources: ['canvas/block_node.tsx', 'canvas/note_node.tsx'],
    keys: [
      ['Enter', 'Take the name'],
      ['Ctrl+Enter', 'Take the note'],
      ['Esc', 'Leave it as it was'],
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
      ['↑, ↓', 'Go through the list'],
      ['Enter', 'Take what is chosen or typed'],
      ['Esc', 'Close'],
    ],
  },
  {
    place: 'Time line',
    sources: ['run/timeline.tsx'],
    keys: [
      ['Space', 'Play the run, or hold it'],
      ['arrows', 'One instant on or back; with Shift ten'],
      ['Home, End', 'To the begin and the end of the run'],
    ],
  },
  {
    place: 'Scopes',
    sources: [],
    keys: [
      ['wheel', 'Zoom the time in all scopes; over the axis of values zoom that scope\u2019s values'],
      ['drag', 'Show a stretch of time; over the axis of values move them'],
      ['Shift+drag', 'Move through the time'],
      ['double click', 'The whole run; on the axis of values all of them'],
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
      ['↑, ↓', 'The same cell of the next link or of the one before'],
      ['Enter', 'Take what is typed and go to the next link; with Shift to the one before'],
      ['Esc', 'Leave the cell as it was'],
      ['?', 'This list'],
    ],
  },
]
