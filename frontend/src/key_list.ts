/** Keys that are not commands, such as navigation keys, for one part of the front end. */
interface KeyGroup {
  title: string
  /** The source files that handle these keys; a test compares them. */
  sources: string[]
  /** Key combinations, separated by a comma, and their effect. */
  keys: [combinations: string, effect: string][]
}

export const KEYS: KeyGroup[] = [
  {
    title: 'On the sheet',
    sources: ['canvas/sheet_keys.ts', 'held_keys.ts', 'canvas/proposed_line.tsx'],
    keys: [
      ['letters', 'Add a block: type its name'],
      ['Tab', 'Select the next block, or the dashed wire at the block that was just placed'],
      ['Enter, Space on a dashed wire', 'Connect the block with the free port in front of it'],
      ['F2', 'Rename the block; edit the note'],
      ['Enter', 'Open the block: its parameters, or the sheet inside; edit the note'],
      ['arrows', 'Move the selection; with Shift by one pixel'],
      ['Del, Backspace', 'Delete blocks, wires and notes'],
      ['Esc', 'Remove the dashed wire, clear the selection, leave the subsystem'],
      ['>', 'Draw a wire by the names of its ports'],
      ['"', 'Write a note'],
      ['Space', 'Fit the sheet into the window'],
      ['+, =', 'Zoom in'],
      ['-', 'Zoom out'],
      ['1', 'Show the sheet at 100 %'],
      ['2', 'Zoom to the selection'],
      ['?', 'Show this list'],
    ],
  },
  {
    title: 'With the mouse on the sheet',
    sources: ['canvas/pointer_drag.ts', 'canvas/subsystem_preview.tsx'],
    keys: [
      ['Shift+drag', 'Disconnect a block and connect its neighbours'],
      ['Ctrl+drag, right drag', 'Duplicate blocks at the pointer; from a wire: branch'],
      ['Shift+click', 'Add a block or wire to the selection, or remove it'],
      ['Ctrl+click', 'Select a further block, and connect it to the selected block'],
      ['drag the end of a wire', 'Connect the wire to another input'],
      ['right click, Menu key', 'Commands on a block, wire, port, chart, the sheet or the arm'],
      ['Alt while dragging', 'Do not align the block with others'],
      ['drag a corner', 'Resize the selected block'],
      ['drag from a port', 'Draw a wire; on the empty sheet add a block at its end'],
      ['click on a dashed wire', 'Connect a block with the free port in front of it'],
      ['double click', 'Open a block, or edit its name; after a run show the chart of a scope'],
      ['double click on a wire', 'Name its signal'],
      ['double click on the empty sheet', 'Add a block'],
      ['middle button, Space+drag', 'Move the sheet'],
      ['Ctrl+wheel', 'Zoom'],
      ['rest on a subsystem', 'Show a picture of the sheet inside; also with the keyboard focus'],
      ['Esc', 'Cancel the drag; close the picture'],
    ],
  },
  {
    title: 'Names, notes and the stop time',
    sources: ['canvas/block_node.tsx', 'canvas/note_node.tsx', 'canvas/signal_names.tsx', 'run/top_bar.tsx'],
    keys: [
      ['Enter', 'Accept the name or the stop time'],
      ['Ctrl+Enter', 'Accept the note'],
      ['Esc', 'Discard the change'],
    ],
  },
  {
    title: 'Dialogs of blocks',
    sources: ['inspector/block_dialog.tsx'],
    keys: [
      ['Enter', 'Accept the values'],
      ['Ctrl+Enter', 'Accept the values and run the model'],
      ['Esc', 'Discard the changes'],
    ],
  },
  {
    title: 'Document tabs',
    sources: ['documents/tab_strip.tsx'],
    keys: [
      ['arrows', 'Show the next or previous document'],
      ['Home, End', 'Show the first or last document'],
      ['Del, middle click', 'Close the document'],
      ['right click, Menu key', 'Commands on the document'],
    ],
  },
  {
    title: 'Lists, fields and the tour',
    sources: [
      'library/pick_list.tsx',
      'library/type_ahead.ts',
      'documents/open_dialog.tsx',
      'documents/tour.tsx',
      'scopes/inspector.tsx',
      'run/tune_panel.tsx',
      'run/parameter_sets_dialog.tsx',
      'robot/joint_slider.tsx',
    ],
    keys: [
      ['↑, ↓', 'Move through the list'],
      ['Enter', 'Accept the selected or typed entry'],
      ['Esc', 'Close'],
    ],
  },
  {
    title: 'List of bookmarks',
    sources: ['documents/bookmarks_dialog.tsx'],
    keys: [
      ['↑, ↓, Home, End', 'Move through the list'],
      ['Enter', 'Show the view of the bookmark'],
      ['F2', 'Rename the bookmark; Esc discards the name'],
      ['Del', 'Remove the bookmark'],
      ['Esc', 'Close the list'],
    ],
  },
  {
    title: 'Timeline',
    sources: ['run/timeline.tsx'],
    keys: [
      ['Space', 'Play or pause the playback'],
      ['arrows', 'One sample forward or back; with Shift ten'],
      ['Home, End', 'Go to the start or end of the run'],
    ],
  },
  {
    title: 'Scopes',
    sources: [],
    keys: [
      ['wheel', 'Zoom the time axis of all scopes; over the value axis zoom that scope\u2019s values'],
      ['drag', 'Zoom the time axis into the range; over the value axis move the values'],
      ['Shift+drag, Shift+wheel', 'Move the time axis; also with the middle button'],
      ['click', 'Set the time cursor'],
      ['double click', 'Show the whole run; on the value axis show all values'],
    ],
  },
  {
    title: 'Robot view',
    sources: ['robot/stage.tsx'],
    keys: [
      ['arrows', 'Turn the view'],
      ['+, =', 'Zoom in'],
      ['-', 'Zoom out'],
      ['Home', 'View from a corner'],
      ['Space', 'Show the whole arm'],
    ],
  },
  {
    title: 'Arm of the robot editor, and its panel Teach',
    sources: [
      'robot/editor/arm_panel.tsx',
      'robot/teach/tool_section.tsx',
      'robot/teach/pose_list.tsx',
      'robot/teach/motion_section.tsx',
    ],
    keys: [
      ['arrows', 'With Shift: move the tool by one step along x or y; with Alt as well: turn it'],
      ['PageUp, PageDown', 'With Shift: move the tool by one step along z; with Alt as well: turn it'],
      ['Enter', 'Move the tool to the typed pose; rename the pose; run the motion'],
      ['Esc', 'Discard the typed pose or name'],
      ['Alt+↑, Alt+↓', 'Move the recorded pose up or down'],
    ],
  },
  {
    title: 'Robot editor',
    sources: ['robot/editor/robot_editor.tsx', 'robot/editor/table.tsx'],
    keys: [
      ['Ctrl+S', 'Save the robot'],
      ['Ctrl+Z', 'Undo'],
      ['Ctrl+Y, Ctrl+Shift+Z', 'Redo'],
      ['↑, ↓', 'Go to the same cell of the next or previous link'],
      ['Enter', 'Accept and go to the next link; with Shift to the previous link'],
      ['Esc', 'Discard the change of the cell'],
      ['?', 'Show this list'],
    ],
  },
]
