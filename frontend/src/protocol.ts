/*
 * The types of all messages between server and front end; long, because there are many messages.
 * Made from src/armblocks/studio/protocol/messages by scripts/studio_types.py: do not edit.
 */

export interface Messages {
  envelope: Envelope;
  server: ServerMessage;
  replies: Replies;
}
/**
 * A request with its number.
 */
export interface Envelope {
  number: number;
  request:
    | AskMask
    | Attach
    | AskBookmarks
    | Change
    | Close
    | Control
    | Copy
    | DataFileList
    | Drop
    | Files
    | Find
    | IgnoreFileChange
    | AskMotion
    | AskMotionRows
    | New
    | Open
    | OpenShipped
    | AskOutline
    | AskParameterSets
    | AskPicture
    | Ping
    | AskPose
    | PreviewTable
    | AskReach
    | ReadSource
    | AskReadings
    | Recover
    | Redo
    | Reload
    | Rewind
    | RobotOfBlock
    | AskRobotTables
    | RouteWires
    | Run
    | Save
    | SaveMotion
    | AskScene
    | ShowSheet
    | SetSpeed
    | StoreFile
    | TrustSource
    | Tune
    | TypedValue
    | TypedSettings
    | Undo
    | AskWorkspace;
}
/**
 * Return the mask of a subsystem or of the sheet, as the :class:`SetMask` that declares it.
 */
export interface AskMask {
  kind: "ask_mask";
  document: string;
  inside?: string[];
  block?: string;
}
/**
 * Show a document again: after a reload, after a lost connection, or in a second client.
 *
 * If the server does not have the document open after a restart, it recovers the document from its journal,
 * or opens the file ``path`` or the shipped ``origin``. The document keeps its key, so that edits that the
 * client sends again are applied to it. ``inside`` is the path of the displayed sheet of a diagram.
 */
export interface Attach {
  kind: "attach";
  document: string;
  document_kind: "diagram" | "robot";
  inside?: string[];
  path?: string | null;
  origin?: string;
  in_front?: boolean;
}
/**
 * Return the bookmarks of all sheets of a model.
 */
export interface AskBookmarks {
  kind: "bookmarks";
  document: string;
}
/**
 * Apply an edit.
 *
 * ``inside``: names of the subsystems that lead to the edited sheet of a diagram. Consecutive changes with
 * the same ``gesture`` (for example the letters typed into a cell) are one undo step.
 */
export interface Change {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "change";
  inside?: string[];
  gesture?: string;
  edit:
    | AddBlocks
    | AddBookmark
    | AddJoint
    | SetAppearance
    | ApplyParameterSet
    | ArrangeBlocks
    | BendWires
    | BreakLink
    | SetCell
    | CommentBlocks
    | Connect
    | SetConvention
    | Describe
    | GroundPorts
    | GroupBlocks
    | KeepTuned
    | LogSignal
    | SetMask
    | MoveBlocks
    | MoveJoint
    | MovePose
    | NameSignal
    | SetNotes
    | SetParameters
    | PasteBlocks
    | RecordPose
    | RemoveBlocks
    | RemoveBookmark
    | RemoveJoint
    | RemoveParameterSet
    | RemovePose
    | RemoveSetParameter
    | Rename
    | RenameBookmark
    | RenameLink
    | RenameParameterSet
    | RenamePose
    | SaveParameterSet
    | SetScopeTrigger
    | SetSettings
    | UpdatePose;
}
/**
 * Add blocks and connect them; without blocks, only add wires.
 *
 * ``instead``: wires that are removed, for example the wire on which a block is dropped.
 */
export interface AddBlocks {
  kind: "add";
  blocks: NewBlock[];
  wires?: Wire[];
  instead?: Wire[];
}
/**
 * A block to be added. ``parameters`` contains the values that differ from the defaults.
 */
export interface NewBlock {
  name: string;
  type: string;
  parameters?: {
    [k: string]: unknown;
  };
  place: Place;
}
/**
 * Position and appearance of a block: top left corner, and its size if it is not the default, px.
 */
export interface Place {
  x: number;
  y: number;
  width?: number | null;
  height?: number | null;
  flipped?: boolean;
  rotation?: 0 | 90 | 180 | 270;
  name_side?: "auto" | "below" | "above" | "left" | "right" | "hidden";
  colour?: "none" | "red" | "orange" | "yellow" | "green" | "cyan" | "blue" | "purple" | "grey";
}
/**
 * A wire between two ports, written ``block/port``.
 *
 * ``bends``: the corners of a route drawn by the user, see :func:`armblocks.drawing.wires.bent`.
 */
export interface Wire {
  source: string;
  target: string;
  bends?: number[];
}
/**
 * Store a part of the sheet under a name. ``replace``: the bookmark exists, and gets this part.
 */
export interface AddBookmark {
  kind: "add_bookmark";
  name: string;
  part: SheetPart;
  replace?: boolean;
}
/**
 * A part of a sheet, px: top left corner and size.
 */
export interface SheetPart {
  x: number;
  y: number;
  width: number;
  height: number;
}
/**
 * Insert a new link after another link, or at the base if ``after`` is empty.
 */
export interface AddJoint {
  kind: "add_joint";
  after: string;
}
/**
 * Set the side of the names of blocks, or their background; ``None`` leaves it unchanged.
 */
export interface SetAppearance {
  kind: "appearance";
  blocks: string[];
  name_side?: ("auto" | "below" | "above" | "left" | "right" | "hidden") | null;
  colour?: ("none" | "red" | "orange" | "yellow" | "green" | "cyan" | "blue" | "purple" | "grey") | null;
}
/**
 * Write the values of a parameter set into the model.
 */
export interface ApplyParameterSet {
  kind: "apply_parameter_set";
  name: string;
}
/**
 * Lay out the blocks of a sheet again, from left to right.
 */
export interface ArrangeBlocks {
  kind: "arrange";
}
/**
 * Set the bends of wires; a wire without bends is routed automatically.
 */
export interface BendWires {
  kind: "bend";
  wires: Wire[];
}
/**
 * Replace the link to a library by a copy of the library block, which can be edited.
 */
export interface BreakLink {
  kind: "break_link";
  block: string;
}
/**
 * Set the text of one cell of a link, or of the robot if ``link`` is empty.
 */
export interface SetCell {
  kind: "cell";
  link: string;
  column: string;
  text: string;
  angles: "deg" | "rad";
}
/**
 * Comment blocks out or through, or remove their comments; see :mod:`armblocks.diagram.comments`.
 */
export interface CommentBlocks {
  kind: "comment";
  blocks: string[];
  comment: "out" | "through" | "";
}
/**
 * Add a wire. With ``replace`` the present wire of the input is removed.
 *
 * ``instead``: wires that are removed, for example the wire whose end is moved to another input.
 */
export interface Connect {
  kind: "connect";
  wire: Wire;
  replace?: boolean;
  instead?: Wire[];
}
/**
 * Interpret the D-H rows in another convention, or with ``keep_arm`` convert them for the same arm.
 */
export interface SetConvention {
  kind: "convention";
  convention: "standard" | "modified";
  keep_arm: boolean;
}
/**
 * Change the model's one-line description.
 */
export interface Describe {
  kind: "describe";
  text: string;
}
/**
 * Add a Ground or a Terminator at every unconnected port of these blocks; without blocks, of the
 * sheet.
 */
export interface GroundPorts {
  kind: "ground";
  blocks?: string[];
}
/**
 * Move blocks into a new subsystem; its ports are the wires that cross its boundary.
 */
export interface GroupBlocks {
  kind: "group";
  blocks: string[];
  name: string;
}
/**
 * Write tuned values of a run, by ``block.parameter``, into the model, as one undo step.
 */
export interface KeepTuned {
  kind: "keep_tuned";
  values: {
    [k: string]: unknown;
  };
}
/**
 * Start or stop logging an output ``block/port``, whose signal is then recorded without a Scope.
 */
export interface LogSignal {
  kind: "log";
  port: string;
  logged: boolean;
}
/**
 * Declare the parameters of a subsystem, in this order, or of the sheet itself if ``block`` is empty.
 *
 * ``name`` is the text on its face; empty leaves the text unchanged.
 */
export interface SetMask {
  kind: "mask";
  block?: string;
  name?: string;
  /**
   * @maxItems 200
   */
  parameters: MaskParameter[];
}
/**
 * A parameter of a mask. ``default`` is the typed text; ``was`` the former name.
 *
 * ``minimum``, ``above`` and ``maximum`` bound its numbers; ``choices`` are the allowed values of a choice.
 */
export interface MaskParameter {
  name: string;
  was?: string;
  kind?: "number" | "array" | "integer" | "boolean" | "choice" | "string" | "robot";
  default: unknown;
  unit?: string;
  doc?: string;
  minimum?: number | null;
  above?: number | null;
  maximum?: number | null;
  choices?: string[];
}
/**
 * Move blocks and notes, or rotate blocks; one drag is one edit.
 *
 * User-drawn routes between blocks that move by the same amount move with them. ``wires`` are added and the
 * wires of ``instead`` removed, when a block is inserted into a wire or disconnected from its wires.
 */
export interface MoveBlocks {
  kind: "move";
  places?: {
    [k: string]: Place;
  };
  notes?: {
    [k: string]: SheetNote;
  };
  wires?: Wire[];
  instead?: Wire[];
}
/**
 * A note on the sheet: its text, and its top left corner in px.
 *
 * This interface was referenced by `undefined`'s JSON-Schema definition
 * via the `patternProperty` "^/\S+$".
 */
export interface SheetNote {
  x: number;
  y: number;
  text: string;
}
/**
 * Exchange a link of a chain with the previous link (``by`` is -1) or with the next link (1).
 */
export interface MoveJoint {
  kind: "move_joint";
  link: string;
  by: -1 | 1;
}
/**
 * Move a pose by a number of places in the list, toward the end if ``by`` is positive.
 */
export interface MovePose {
  kind: "move_pose";
  name: string;
  by: number;
}
/**
 * Name the signal at an output ``block/port``; an empty name removes the name.
 */
export interface NameSignal {
  kind: "name_signal";
  port: string;
  name: string;
}
/**
 * Add notes or change their text.
 */
export interface SetNotes {
  kind: "notes";
  notes: {
    [k: string]: SheetNote;
  };
}
/**
 * Change parameters of one block. Wires to ports that no longer exist are removed.
 */
export interface SetParameters {
  kind: "parameters";
  block: string;
  values: {
    [k: string]: unknown;
  };
}
/**
 * Paste blocks: ``text`` is a diagram in the file format.
 *
 * ``names``: new names of its blocks and notes, where they differ. ``shift``: displacement to the right and
 * down, px; one number if both are equal.
 */
export interface PasteBlocks {
  kind: "paste";
  text: string;
  names?: {
    [k: string]: string;
  };
  shift?: number | [number, number];
}
/**
 * Append a pose, or insert it after another pose. Without a name it is called P1, P2 …
 */
export interface RecordPose {
  kind: "record_pose";
  /**
   * @maxItems 1000
   */
  q: number[];
  name?: string;
  after?: string;
}
/**
 * Remove blocks, wires and notes; the wires of the removed blocks are removed with them.
 *
 * ``reconnections``: wires that are added between the former neighbours of the removed blocks.
 */
export interface RemoveBlocks {
  kind: "remove";
  blocks?: string[];
  wires?: Wire[];
  notes?: string[];
  reconnections?: Wire[];
}
/**
 * Remove a bookmark of the sheet.
 */
export interface RemoveBookmark {
  kind: "remove_bookmark";
  name: string;
}
/**
 * Remove a link; its child links are attached to its parent.
 */
export interface RemoveJoint {
  kind: "remove_joint";
  link: string;
}
/**
 * Remove a parameter set.
 */
export interface RemoveParameterSet {
  kind: "remove_parameter_set";
  name: string;
}
/**
 * Remove a pose.
 */
export interface RemovePose {
  kind: "remove_pose";
  name: string;
}
/**
 * Remove a parameter from all parameter sets, also one that does not exist in the model.
 */
export interface RemoveSetParameter {
  kind: "remove_set_parameter";
  path: string;
}
/**
 * Rename a block; its wires and its position remain.
 */
export interface Rename {
  kind: "rename";
  block: string;
  name: string;
}
/**
 * Rename a bookmark of the sheet.
 */
export interface RenameBookmark {
  kind: "rename_bookmark";
  name: string;
  to: string;
}
/**
 * Give a link another name.
 */
export interface RenameLink {
  kind: "rename_link";
  link: string;
  name: string;
}
/**
 * Rename a parameter set.
 */
export interface RenameParameterSet {
  kind: "rename_parameter_set";
  name: string;
  to: string;
}
/**
 * Give a pose the name ``to``.
 */
export interface RenamePose {
  kind: "rename_pose";
  name: string;
  to: string;
}
/**
 * Store values of parameters, by ``block.parameter``, under a name.
 *
 * ``all_parameters``: the model's values of the parameters that only other sets have are stored, too.
 * ``replace``: the values replace the values of a set with this name, which must exist.
 */
export interface SaveParameterSet {
  kind: "save_parameter_set";
  name: string;
  values: {
    [k: string]: unknown;
  };
  all_parameters?: boolean;
  replace?: boolean;
}
/**
 * Set the trigger of the scopes; ``None`` restores the default, which is off.
 */
export interface SetScopeTrigger {
  kind: "scope_trigger";
  trigger: ScopeTriggerSettings | null;
}
/**
 * The trigger of the scopes, see :class:`~armblocks.diagram.ScopeTrigger`.
 */
export interface ScopeTriggerSettings {
  on: boolean;
  signal: string;
  element: number;
  edge: "rising" | "falling" | "either";
  level: number;
  mode: "normal" | "auto" | "single";
  span: number;
  position: number;
  hold_off: number;
}
/**
 * Change run settings, by the names of ``SimulationOptions``; ``None`` restores the default.
 */
export interface SetSettings {
  kind: "settings";
  values: {
    [k: string]: boolean | number | string | null;
  };
}
/**
 * Replace the coordinates of a pose.
 */
export interface UpdatePose {
  kind: "update_pose";
  name: string;
  /**
   * @maxItems 1000
   */
  q: number[];
}
/**
 * Close a document on this client; ``discard`` is required if it has unsaved edits.
 *
 * A document that another client shows stays open there, with its edits; the reply is then ``False``.
 */
export interface Close {
  kind: "close";
  document: string;
  discard?: boolean;
}
/**
 * Pause, resume, stop or step a run. ``step`` and ``back`` move by one sample.
 */
export interface Control {
  run: string;
  kind: "control";
  action: "pause" | "resume" | "step" | "back" | "stop";
}
/**
 * Return blocks and notes of a sheet as text, for :class:`PasteBlocks`.
 */
export interface Copy {
  kind: "copy";
  document: string;
  inside?: string[];
  blocks: string[];
  notes?: string[];
}
/**
 * Return the files that a parameter of this kind may name.
 */
export interface DataFileList {
  kind: "data_files";
  holds: "table" | "function";
}
/**
 * Open a file that was dropped on the studio: a diagram, a robot or a script (it is not executed).
 */
export interface Drop {
  kind: "drop";
  name: string;
  content: string;
}
/**
 * Return the present files of the project folder.
 */
export interface Files {
  kind: "files";
}
/**
 * Search all sheets: blocks by words in names, types and values, bookmarks by words in names.
 */
export interface Find {
  kind: "find";
  document: string;
  text: string;
}
/**
 * Keep the document although its file has changed on disk; the next save overwrites the file.
 */
export interface IgnoreFileChange {
  kind: "ignore_file_change";
  document: string;
}
/**
 * Plan the motion, for its display.
 */
export interface AskMotion {
  document: string;
  poses?: string[] | null;
  course: "joint" | "line" | "spline";
  duration?: number | null;
  kind: "motion";
}
/**
 * Return the motion as the parameter of a Trajectory block: rows of t, q, qd, qdd.
 */
export interface AskMotionRows {
  document: string;
  poses?: string[] | null;
  course: "joint" | "line" | "spline";
  duration?: number | null;
  kind: "motion_rows";
}
/**
 * Create a new document.
 */
export interface New {
  kind: "new";
  document_kind: "diagram" | "robot";
}
/**
 * Open a file of the project: a diagram, a robot, or a script of robots.
 *
 * The reply contains the keys of the documents; the front end shows the first document.
 */
export interface Open {
  kind: "open";
  path: string;
}
/**
 * Open a copy of a shipped example or robot.
 */
export interface OpenShipped {
  kind: "open_shipped";
  document_kind: "diagram" | "robot";
  name: string;
}
/**
 * Return the tree of sheets.
 */
export interface AskOutline {
  kind: "outline";
  document: string;
}
/**
 * Return the parameter sets of a model.
 *
 * The reply also contains the model's values of all parameters in the sets and in ``also``.
 */
export interface AskParameterSets {
  kind: "parameter_sets";
  document: string;
  /**
   * @maxItems 1000
   */
  also?: string[];
}
/**
 * Return a drawing of a robot at ``q``, as SVG.
 */
export interface AskPicture {
  document: string;
  inside?: string[];
  block?: string;
  kind: "picture";
  /**
   * @maxItems 1000
   */
  q: number[];
  theme: "light" | "dark";
}
/**
 * Test the connection; the reply has no content.
 */
export interface Ping {
  kind: "ping";
}
/**
 * Return the poses of base, links and tool of a robot at ``q``: (L+2, 4, 4).
 */
export interface AskPose {
  document: string;
  inside?: string[];
  block?: string;
  kind: "pose";
  /**
   * @maxItems 1000
   */
  q: number[];
}
/**
 * Read a file; ``time`` and ``columns`` are empty where the file determines them.
 */
export interface PreviewTable {
  kind: "preview_table";
  file: string;
  time?: string;
  /**
   * @maxItems 10000
   */
  columns?: string[];
}
/**
 * Move the tool from its pose at ``q`` to ``target``, in the same configuration of the arm.
 *
 * ``target``: 16 numbers, the pose in the world row by row, m.
 */
export interface AskReach {
  document: string;
  kind: "reach";
  /**
   * @maxItems 1000
   */
  q: number[];
  /**
   * @maxItems 1000
   */
  target: number[];
}
/**
 * Return the content of a Python file.
 */
export interface ReadSource {
  kind: "read_source";
  file: string;
}
/**
 * Compute the read-outs of the robot of a document at ``q, qd, qdd``.
 */
export interface AskReadings {
  kind: "readings";
  document: string;
  /**
   * @maxItems 1000
   */
  q: number[];
  /**
   * @maxItems 1000
   */
  qd: number[];
  /**
   * @maxItems 1000
   */
  qdd: number[];
}
/**
 * Recover or discard a document of an earlier server.
 *
 * ``open`` opens it with its unsaved edits; ``keep_both`` saves it as a new file beside the original one and
 * opens the new file; ``discard`` deletes the journal.
 */
export interface Recover {
  kind: "recover";
  document: string;
  action: "open" | "keep_both" | "discard";
}
/**
 * Repeat the edit that was undone last.
 */
export interface Redo {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "redo";
}
/**
 * Replace the document by the content of its file, as one undo step.
 */
export interface Reload {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "reload";
}
/**
 * Pause a run and return to a time (s). Later samples are discarded; tuned values remain.
 */
export interface Rewind {
  run: string;
  kind: "rewind";
  time: number;
}
/**
 * Open the robot of a block: its file, or a copy of a shipped robot.
 */
export interface RobotOfBlock {
  kind: "robot_of_block";
  document: string;
  inside?: string[];
  block: string;
}
/**
 * Return the columns of the robot tables.
 */
export interface AskRobotTables {
  kind: "robot_tables";
}
/**
 * Return the lines of a sheet during a drag that differ from the lines of the document.
 *
 * ``places``: positions of the dragged blocks. ``wires``: the displayed wires, if they differ from the wires
 * of the document. ``passed``: a block that lines do not avoid, because it may be inserted into one.
 */
export interface RouteWires {
  kind: "route";
  document: string;
  inside?: string[];
  places: {
    [k: string]: BlockCorner;
  };
  wires?: Wire[] | null;
  passed?: string | null;
}
/**
 * The top left corner of a block, px.
 */
export interface BlockCorner {
  x: number;
  y: number;
}
/**
 * Start a run. ``speed`` is simulated seconds per second; ``None`` runs as fast as possible.
 *
 * ``tuned``: tried values of tunable parameters, by ``block.parameter``; the model keeps its own values.
 */
export interface Run {
  kind: "run";
  document: string;
  speed?: number | null;
  tuned?: {
    [k: string]: unknown;
  };
}
/**
 * Write the file, under ``path`` if it is given. ``overwrite``: also if the file has changed on disk.
 *
 * The reply is the path.
 */
export interface Save {
  kind: "save";
  document: string;
  path?: string;
  overwrite?: boolean;
}
/**
 * Write the motion as a CSV file of the project folder. The reply is its path.
 */
export interface SaveMotion {
  document: string;
  poses?: string[] | null;
  course: "joint" | "line" | "spline";
  duration?: number | null;
  kind: "save_motion";
  path: string;
  overwrite?: boolean;
}
/**
 * Return the bodies of a robot.
 */
export interface AskScene {
  document: string;
  inside?: string[];
  block?: string;
  kind: "scene";
}
/**
 * Display the sheet inside a subsystem; the empty path is the top sheet.
 */
export interface ShowSheet {
  kind: "show_sheet";
  document: string;
  inside: string[];
}
/**
 * Change the speed of a run; ``None`` runs as fast as possible.
 */
export interface SetSpeed {
  run: string;
  kind: "speed";
  speed?: number | null;
}
/**
 * Store a dropped table file in the project folder; ``replace``: overwrite a file of the same name.
 */
export interface StoreFile {
  kind: "store_file";
  name: string;
  content: string;
  replace?: boolean;
}
/**
 * Trust a Python file with the content that the client has shown, or withdraw the trust.
 *
 * The request is refused if the content of the file no longer has this ``digest``.
 */
export interface TrustSource {
  kind: "trust_source";
  file: string;
  digest: string;
  trusted: boolean;
}
/**
 * Change tunable parameters during a run, by ``block.parameter``, all at the same time.
 */
export interface Tune {
  run: string;
  kind: "tune";
  values: {
    [k: string]: unknown;
  };
}
/**
 * Parse a text typed into a parameter field; the reply is its value, a refusal describes the error.
 */
export interface TypedValue {
  kind: "typed";
  document?: string;
  inside?: string[];
  block?: string;
  type: string;
  parameter: string;
  text: string;
}
/**
 * Check settings while they are typed; the reply has an error text for each invalid setting, by name.
 */
export interface TypedSettings {
  kind: "typed_settings";
  document: string;
  values: {
    [k: string]: boolean | number | string | null;
  };
}
/**
 * Revert the last edit.
 */
export interface Undo {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "undo";
}
/**
 * Return positions of the tool (N, 3) m at random configurations within the limits.
 */
export interface AskWorkspace {
  document: string;
  kind: "workspace";
}
/**
 * All text messages of the server, for the generated types of the front end.
 */
export interface ServerMessage {
  event:
    | Changed
    | Checked
    | Documents
    | Opened
    | Reply
    | RunProgress
    | RunRenamed
    | RunRewound
    | RunStarted
    | RunTuned
    | Welcome;
}
/**
 * The change of a document from version ``before`` to the version in ``state``, which may be the same.
 */
export interface Changed {
  kind: "changed";
  state: DocumentState;
  before: number;
  change: DiagramChange | RobotChange;
}
/**
 * File, version and save state of a document.
 *
 * ``origin`` is the shipped example or robot from which it was created. ``disk`` compares the file on disk
 * with the version that was opened or saved. ``journaled`` is false if the journal cannot be written; the
 * edits are then lost unless they are saved.
 */
export interface DocumentState {
  document: string;
  kind: "diagram" | "robot";
  version: number;
  title: string;
  path: string | null;
  origin: string;
  dirty: boolean;
  undo: string;
  redo: string;
  disk: "same" | "changed" | "gone";
  journaled: boolean;
}
/**
 * Changes of the displayed sheet and of the run settings.
 */
export interface DiagramChange {
  kind: "diagram";
  sheet: SheetChange;
  settings: {
    [k: string]: boolean | number | string | null;
  };
  scope_trigger: ScopeTriggerSettings | null;
  outer_comment: OuterComment | null;
  renamed?: {
    [k: string]: string;
  };
}
/**
 * The difference between two versions of a sheet.
 */
export interface SheetChange {
  blocks: {
    [k: string]: SheetBlock | null;
  };
  wires_added: Wire[];
  wires_removed: Wire[];
  lines: {
    [k: string]: WireLines | null;
  };
  notes?: {
    [k: string]: SheetNote;
  } | null;
  description?: string | null;
  logged?: string[] | null;
}
/**
 * A block as drawn on the sheet. ``face`` is SVG in the block's px; its colours are CSS classes.
 */
export interface SheetBlock {
  name: string;
  type: string;
  title: string;
  place: Place;
  width: number;
  height: number;
  face: string;
  inputs: SheetPort[];
  outputs: SheetPort[];
  opens: boolean;
  shown_name_side: "below" | "above" | "left" | "right" | "corner" | "hidden";
  parameters: {
    [k: string]: unknown;
  };
  formulas: {
    [k: string]: string;
  };
  mask: ParameterRule[];
  link: string;
  comment?: "out" | "through" | "";
}
/**
 * A port on the edge of its block: position from the block's corner in px, and direction of its wire.
 *
 * The direction points out of the block for an output and into the block for an input. A frame port has a
 * direction in both lists, each with the sign of its list.
 */
export interface SheetPort {
  name: string;
  doc: string;
  label: string;
  unit: string;
  x: number;
  y: number;
  dx: number;
  dy: number;
  frame?: boolean;
}
/**
 * The declaration of one parameter of a block type, for its dialog.
 */
export interface ParameterRule {
  name: string;
  kind: string;
  doc: string;
  unit: string;
  default: unknown;
  tunable: boolean;
  choices: string[];
  allowed: string;
}
/**
 * The lines of the wires from one output, px.
 *
 * ``paths``: the corner points of the line to each target, from the output or from a branch. A path without
 * points means that there is no room for a line: output and target have ``label`` instead. ``dots``:
 * branches.
 */
export interface WireLines {
  paths: {
    [k: string]: [number, number][];
  };
  dots: [number, number][];
  label: string;
  name?: string;
  propagated_name?: string;
  name_at?: [number, number, "start" | "middle"] | null;
}
/**
 * The outermost commented subsystem that contains a sheet: its path, and its comment.
 */
export interface OuterComment {
  path: string[];
  comment: "out" | "through";
}
/**
 * A robot after a change: the complete content, because one cell may affect many others.
 */
export interface RobotChange {
  kind: "robot";
  content: RobotContent;
}
/**
 * A robot as the tables of its editor show it.
 */
export interface RobotContent {
  kind: "robot";
  name: string;
  convention: "standard" | "modified" | "";
  chain: boolean;
  links: LinkRow[];
  coordinates: Coordinate[];
  speeds: Speed[];
  poses: Pose[];
  published_poses: string[];
  fields: {
    [k: string]: number | string | null;
  };
  findings: RobotFinding[];
}
/**
 * A link as a row of the tables: values by column in SI units, ``None`` for an empty cell.
 */
export interface LinkRow {
  name: string;
  parent: string | null;
  turns: boolean;
  moves: boolean;
  variable: string;
  cells: {
    [k: string]: number | string | null;
  };
  locked: {
    [k: string]: string;
  };
}
/**
 * An entry of q: its name, its unit (rad, m or 1), and its limits if it has them.
 *
 * ``rest`` is its value in the pose that is shown without motion.
 */
export interface Coordinate {
  name: string;
  unit: string;
  low: number | null;
  high: number | null;
  rest: number;
}
/**
 * An entry of qd: its name, the unit of its coordinate (rad or m), and its limit if it has one.
 */
export interface Speed {
  name: string;
  unit: string;
  limit: number | null;
}
/**
 * A recorded pose: its name and coordinates.
 */
export interface Pose {
  name: string;
  q: number[];
}
/**
 * A physically impossible value, and the columns of the link that contain it.
 */
export interface RobotFinding {
  link: string;
  columns: string[];
  what: string;
  fix: string;
}
/**
 * The findings of the background check for one version of a document; ``wires`` by source port.
 */
export interface Checked {
  kind: "checked";
  document: string;
  version: number;
  findings: Finding[];
  wires: {
    [k: string]: WireKind;
  };
}
/**
 * A finding of the background check; ``block`` and ``port`` are ``""`` for the whole diagram.
 */
export interface Finding {
  severity: "error" | "warning";
  block: string;
  port: string;
  what: string;
  fix: string;
}
/**
 * Type and shape of the signal on the wires of an output port.
 */
export interface WireKind {
  shape: number[];
  unit: string;
  bus?: boolean;
}
/**
 * The open and the recoverable documents, sent when either list has changed.
 */
export interface Documents {
  kind: "documents";
  documents: DocumentState[];
  recoveries: Recovery[];
}
/**
 * An unsaved document of an earlier server that can be recovered from its journal.
 *
 * ``path`` is its file, or ``None`` if it was never saved. ``began`` and ``last`` are the times of the first
 * and the last edit since the save (s since 1970), ``edits`` is their number, ``parts`` the number of blocks
 * or links. ``disk`` states whether the file has changed since the edits. ``missing`` describes the edits
 * that could not be recovered.
 */
export interface Recovery {
  document: string;
  kind: "diagram" | "robot";
  title: string;
  path: string | null;
  began: number;
  last: number;
  edits: number;
  parts: number;
  disk: "same" | "changed" | "gone";
  missing: string;
}
/**
 * A complete document, for a client that shows it from now on.
 *
 * ``notes``: warnings issued while its file was read. ``in_front``: whether it is brought to the front.
 */
export interface Opened {
  kind: "opened";
  state: DocumentState;
  content: DiagramContent | RobotContent;
  notes: string[];
  in_front: boolean;
}
/**
 * The displayed sheet of a diagram, and the run settings.
 *
 * ``inside``: names of the subsystems that lead to the sheet. ``settings`` use the names of
 * ``SimulationOptions``. ``run``: key of the current or last run of the diagram.
 */
export interface DiagramContent {
  kind: "diagram";
  inside: string[];
  sheet: Sheet;
  settings: {
    [k: string]: boolean | number | string | null;
  };
  scope_trigger: ScopeTriggerSettings | null;
  run: string | null;
  outer_comment: OuterComment | null;
}
/**
 * The complete drawing of a sheet.
 */
export interface Sheet {
  name: string;
  description: string;
  blocks: {
    [k: string]: SheetBlock;
  };
  wires: Wire[];
  lines: {
    [k: string]: WireLines;
  };
  notes: {
    [k: string]: SheetNote;
  };
  logged: string[];
  linked: string[];
  link: string;
}
/**
 * The reply to a request; ``fault`` is set if the request was refused.
 */
export interface Reply {
  kind: "reply";
  number: number;
  value?: {
    [k: string]: unknown;
  };
  fault?: Fault | null;
}
/**
 * The reason for a refused request: the fields of an ``ArmblocksError``.
 */
export interface Fault {
  what: string;
  where: string;
  allowed: string;
  fix: string;
}
/**
 * State and time of a run. At the end, ``solver`` and ``reason`` state which solver was used and why.
 */
export interface RunProgress {
  kind: "run_progress";
  document: string;
  run: string;
  state: "running" | "paused" | "done" | "stopped" | "failed";
  time: number;
  real_time_factor: number;
  message: string;
  fault?: Fault | null;
  solver?: string;
  reason?: string;
}
/**
 * Blocks of the diagram of a run were renamed; ``renamed`` has their old and new paths.
 */
export interface RunRenamed {
  kind: "run_renamed";
  run: string;
  renamed: {
    [k: string]: string;
  };
}
/**
 * A run has returned to an earlier time (s); only the first ``count`` samples remain valid.
 */
export interface RunRewound {
  kind: "run_rewound";
  run: string;
  time: number;
  count: number;
}
/**
 * The start of a run: its recorded signals, views and tunable parameters.
 */
export interface RunStarted {
  kind: "run_started";
  document: string;
  run: string;
  stop_time: number;
  channels: Channel[];
  views: SinkView[];
  aliases: {
    [k: string]: string;
  };
  tunables: Tunable[];
  stride: number;
}
/**
 * One recorded signal of a run, in the order of the columns of a frame.
 *
 * ``entries`` are the names of the entries of a vector, such as joints; empty if the entries are numbered.
 */
export interface Channel {
  name: string;
  shape: number[];
  unit: string;
  entries: string[];
  title?: string;
}
/**
 * The plot or 3-D view of a sink; ``signals`` are the recorded signals that it shows.
 */
export interface SinkView {
  block: string;
  kind: string;
  signals: string[];
  labels: string[];
  title: string;
}
/**
 * A parameter that can be changed during a run; ``path`` is ``block.parameter``.
 *
 * ``low`` and ``high`` are the bounds that the block declares, ``None`` if unbounded.
 */
export interface Tunable {
  path: string;
  value: unknown;
  unit: string;
  doc: string;
  low: number | null;
  high: number | null;
}
/**
 * A parameter of a run has this value from this time (s) on.
 */
export interface RunTuned {
  kind: "run_tuned";
  run: string;
  time: number;
  parameter: string;
  value: unknown;
}
/**
 * The first message: library, examples, files and open documents.
 */
export interface Welcome {
  kind: "welcome";
  version: string;
  library: BlockType[];
  robots: string[];
  solvers: SolverChoice[];
  settings: SettingRule[];
  examples: {
    [k: string]: string;
  };
  files: string[];
  recent: string[];
  documents: DocumentState[];
  recoveries: Recovery[];
}
/**
 * A block type in the library palette. ``face`` is the drawing with default parameters.
 */
export interface BlockType {
  type: string;
  title: string;
  family: string;
  summary: string;
  documentation: string;
  width: number;
  height: number;
  face: string;
  inputs: string[];
  input_y: number[];
  outputs: string[];
  frames: string[];
  parameters: ParameterRule[];
}
/**
 * A solver that a model may select.
 */
export interface SolverChoice {
  name: string;
  title: string;
  adaptive: boolean;
  stiff: boolean;
}
/**
 * One setting of a run, for the dialog of configuration parameters.
 */
export interface SettingRule {
  name: string;
  title: string;
  unit: string;
  doc: string;
  default: boolean | number | string | null;
}
export interface Replies {
  ask_mask: SetMask;
  attach: string;
  bookmarks: SheetBookmark[];
  change: number;
  close: boolean;
  control: null;
  copy: string;
  data_files: DataFile[];
  drop: string[];
  files: FileList;
  find: FoundBlock[];
  ignore_file_change: null;
  motion: PlannedMotion;
  motion_rows: number[][];
  new: string;
  open: string[];
  open_shipped: string;
  outline: Outline;
  parameter_sets: ParameterSetTable;
  picture: string;
  ping: null;
  pose: number[][][];
  preview_table: TablePreview;
  reach: Reached;
  read_source: FunctionSource;
  readings: Readings;
  recover: string | null;
  redo: number;
  reload: number;
  rewind: null;
  robot_of_block: string;
  robot_tables: RobotTables;
  route: {
    [k: string]: WireLines;
  };
  run: string;
  save: string;
  save_motion: string;
  scene: RobotScene;
  show_sheet: null;
  speed: null;
  store_file: StoredFile;
  trust_source: null;
  tune: null;
  typed: unknown;
  typed_settings: {
    [k: string]: string;
  };
  undo: number;
  workspace: string;
}
/**
 * A bookmark of the sheet at a path. ``linked``: it belongs to a library block and cannot be edited.
 */
export interface SheetBookmark {
  inside: string[];
  name: string;
  part: SheetPart;
  linked: boolean;
}
/**
 * A file of the project; ``size`` in bytes.
 */
export interface DataFile {
  path: string;
  size: number;
}
/**
 * Files of the project folder; ``recent``: recently used files, the latest first.
 */
export interface FileList {
  files: string[];
  recent: string[];
}
/**
 * A block or a bookmark found by a search.
 *
 * ``match`` is the matching value of the block, ``""`` if its name or type matches. ``part`` is the part of
 * the sheet that a bookmark shows; ``title`` is then ``""``.
 */
export interface FoundBlock {
  inside: string[];
  name: string;
  title: string;
  match: string;
  part?: SheetPart | null;
}
/**
 * A motion through poses.
 *
 * ``time`` (N,) s, ``q``, ``qd``, ``qdd`` (N, n) in rad or m and s. ``poses`` (N, L+2, 12): the first three
 * rows of the poses of base, links and tool. ``via``: the times of the recorded poses, s. ``tool_speed``:
 * largest speed of the tool, m/s. ``rows``: the number L+2 of poses at each time. ``exceeded``: a
 * sentence for each exceeded limit.
 */
export interface PlannedMotion {
  time: number[];
  q: number[][];
  qd: number[][];
  qdd: number[][];
  rows: number;
  poses: string;
  via: number[];
  tool_speed: number;
  peaks: JointPeaks[];
  exceeded: string[];
}
/**
 * Extremes of one joint in a motion, with its limits, in rad or m, s, N m or N.
 *
 * ``lowest``, ``highest``: the extreme positions; ``low``, ``high``: the limits of the position. ``speed``,
 * ``torque``: the largest magnitudes. A limit is ``None`` if it is unknown.
 */
export interface JointPeaks {
  name: string;
  unit: string;
  lowest: number;
  highest: number;
  low: number | null;
  high: number | null;
  speed: number;
  speed_limit: number | null;
  torque: number;
  torque_limit: number | null;
}
/**
 * The sheets of a model as a tree.
 */
export interface Outline {
  name: string;
  blocks: number;
  subsystems: Outline[];
}
/**
 * The parameter sets of a model: values by set and path, and the faults of values that are invalid.
 */
export interface ParameterSetTable {
  parameters: SetParameter[];
  sets: {
    [k: string]: {
      [k: string]: unknown;
    };
  };
  faults: {
    [k: string]: {
      [k: string]: string;
    };
  };
}
/**
 * A parameter of parameter sets: its value in the model, and whether it may change during a run.
 */
export interface SetParameter {
  path: string;
  unit: string;
  doc: string;
  value: unknown;
  tunable: boolean;
}
/**
 * The columns of a file, and the table of the chosen columns, or its ``fault``.
 *
 * ``time`` is the column of times, ``chosen`` are the columns of values. ``rows`` are the first rows of
 * these columns as text. ``times`` (s) and ``curves`` are points for a plot: minimum and maximum of groups
 * of rows. ``spacing`` has the minimum and the maximum difference of successive times, s.
 */
export interface TablePreview {
  columns: TableColumn[];
  time: string;
  chosen: string[];
  rows: string[][];
  count: number;
  /**
   * @minItems 2
   * @maxItems 2
   */
  spacing: [number, number];
  times: number[];
  curves: number[][];
  notes: string[];
  fault: Fault | null;
}
/**
 * A column of a file. ``fault`` is the reason why it has no numbers; ``rows`` is then 0.
 */
export interface TableColumn {
  name: string;
  unit: string;
  kind: string;
  rows: number;
  fault: string;
}
/**
 * The configuration of an arm whose tool was dragged.
 *
 * ``q`` (nq,) and the ``poses`` (L+2, 4, 4) of base, links and tool. ``reached``: whether the tool has the
 * target; otherwise ``why`` is the reason. ``at_limit``: the coordinates at a limit. ``missing``: the
 * directions that the joints cannot follow, such as ``turn about x``. ``tool``: the pose of the tool (16,).
 */
export interface Reached {
  q: number[];
  poses: number[][][];
  reached: boolean;
  why: string;
  at_limit: string[];
  missing: string[];
  tool: number[];
}
/**
 * The content of a Python file, which has not been run; ``fault`` is the reason why it is not valid.
 *
 * ``digest`` identifies the content; ``trusted`` states whether its code may run. Invisible characters are
 * written as ``\\u202e``; ``hidden`` is their number.
 */
export interface FunctionSource {
  text: string;
  digest: string;
  trusted: boolean;
  hidden: number;
  functions: SourceFunction[];
  fault: Fault | null;
}
/**
 * A function of a Python file; ``line`` is the line number of its definition.
 */
export interface SourceFunction {
  name: string;
  arguments: string[];
  line: number;
  doc: string;
}
/**
 * Read-outs of an arm in one configuration, in m, rad and N m along world axes.
 */
export interface Readings {
  pose: number[][];
  position: number[];
  rpy: number[];
  jacobian: number[][];
  manipulability: number;
  gravload: number[];
  torque: number[];
  singular: string;
  limits: string[];
}
/**
 * All columns of the tables of robots.
 */
export interface RobotTables {
  kinematics: CellColumn[];
  dynamics: CellColumn[];
  robot: CellColumn[];
}
/**
 * A column of a table, or a field of the robot.
 */
export interface CellColumn {
  name: string;
  title: string;
  doc: string;
  quantity: "number" | "angle" | "coordinate" | "rate" | "text" | "choice";
  unit: string;
  optional: boolean;
  choices: string[];
  group: string;
}
/**
 * Bodies, joints and size of a robot.
 *
 * ``reach`` (m) of the arm; ``foot`` (m): distance by which the bodies of the base extend below its frame.
 * ``rows`` is the number of poses: base, links and tool. ``joints``: joints with one axis. ``rest``: the
 * coordinates q of the pose that is shown without motion.
 */
export interface RobotScene {
  name: string;
  reach: number;
  foot: number;
  rows: number;
  bodies: SceneBody[];
  joints: SceneJoint[];
  rods: SceneRod[];
  rest: number[];
  [k: string]: unknown;
}
/**
 * A body of a robot; its pose is ``row`` of the poses: row 0 is the base, the links and the tool follow,
 * then the rods.
 *
 * ``corners`` (F, 3, 3) m and unit ``normals`` (F, 3, 3) of its triangles: base64 of little-endian float32.
 */
export interface SceneBody {
  row: number;
  material: "paint" | "joint" | "flange" | "base";
  corners: string;
  normals: string;
  [k: string]: unknown;
}
/**
 * A joint: the link of ``row`` moves relative to the body of row ``carrier``.
 *
 * ``frame`` is the joint frame in the frame of ``carrier``, ``moving`` the joint frame in the link frame,
 * both (16,) row by row; z is the joint axis. For a revolute joint, x of ``moving`` is rotated from x of
 * ``frame`` by q + ``offset``; for a prismatic joint, its origin is displaced by q + ``offset``. ``limits``
 * are in rad or m, ``radius`` (m): radius of the cylinder drawn at the joint.
 */
export interface SceneJoint {
  name: string;
  row: number;
  turns: boolean;
  limits: [number, number] | null;
  carrier: number;
  frame: number[];
  moving: number[];
  offset: number;
  radius: number;
  [k: string]: unknown;
}
/**
 * A rod between the point ``first`` (3,) m in the frame of row ``first_row`` and ``second``.
 *
 * The front end computes its pose: the origin is the first point, z points to the second point.
 */
export interface SceneRod {
  first_row: number;
  first: number[];
  second_row: number;
  second: number[];
  [k: string]: unknown;
}
/**
 * The path of a dropped file; ``stored`` is false if a file with this name and another content exists.
 */
export interface StoredFile {
  path: string;
  stored: boolean;
}
