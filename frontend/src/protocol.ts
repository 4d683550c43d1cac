/* Made from src/armblocks/studio/protocol/messages by scripts/studio_types.py: do not edit. */

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
    | Change
    | Close
    | Control
    | Copy
    | Drop
    | Files
    | Find
    | KeepMine
    | Look
    | New
    | Open
    | OpenShipped
    | AskOutline
    | AskPicture
    | Ping
    | AskPose
    | AskReadings
    | Recover
    | Redo
    | Reload
    | Rewind
    | RobotOfBlock
    | AskRobotTables
    | Run
    | Save
    | AskScene
    | SetSpeed
    | Tune
    | TypedValue
    | TypedSettings
    | Undo;
}
/**
 * Ask for the mask of a subsystem, or of the sheet itself: the :class:`SetMask` that would make it.
 */
export interface AskMask {
  kind: "ask_mask";
  document: string;
  inside?: string[];
  block?: string;
}
/**
 * Show a document again: after a reload, after the line was down, or in a second page.
 *
 * Where the server was started anew and does not know it, it comes from its journal, or else from the file
 * or the shipped one of these names, under the same key: edits that wait to be sent again find it. Of a
 * diagram the sheet at the path ``inside`` is shown.
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
 * Carry out an edit.
 *
 * ``inside``: names of the subsystems on the way to the sheet of a diagram that is edited. Changes in a row
 * of one ``gesture`` (the letters typed into one cell) are one step of undo.
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
    | AddJoint
    | ArrangeBlocks
    | BendWires
    | BreakLink
    | SetCell
    | Connect
    | SetConvention
    | Describe
    | GroupBlocks
    | KeepTuned
    | LogSignal
    | SetMask
    | MoveBlocks
    | MoveJoint
    | SetNotes
    | SetParameters
    | PasteBlocks
    | RemoveBlocks
    | RemoveJoint
    | Rename
    | RenameLink
    | SetSettings;
}
/**
 * Put blocks on the sheet, with wires among them or to what is there: insert, paste and duplicate.
 *
 * ``instead``: wires that give way, as where a block is dropped on one.
 */
export interface AddBlocks {
  kind: "add";
  blocks: NewBlock[];
  wires?: Wire[];
  instead?: Wire[];
}
/**
 * A block to be put on the sheet. ``parameters`` states those that are not at their default.
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
 * Where a block stands: top left corner and, if not its own, its size in px.
 */
export interface Place {
  x: number;
  y: number;
  width?: number | null;
  height?: number | null;
  flipped?: boolean;
  rotation?: 0 | 90 | 180 | 270;
}
/**
 * A wire between two ports, written ``block/port``.
 *
 * ``bends``: the way that somebody has drawn, see :func:`armblocks.drawing.wire_routing.bent`.
 */
export interface Wire {
  source: string;
  target: string;
  bends?: number[];
}
/**
 * Put a new link behind another one, or at the base where ``after`` is empty.
 */
export interface AddJoint {
  kind: "add_joint";
  after: string;
}
/**
 * Lay the blocks of a sheet out anew, from left to right.
 */
export interface ArrangeBlocks {
  kind: "arrange";
}
/**
 * Lead wires along the bends that they have here; without any the way is chosen again.
 */
export interface BendWires {
  kind: "bend";
  wires: Wire[];
}
/**
 * Make a block that is linked to a library a copy of one's own, which may be changed inside.
 */
export interface BreakLink {
  kind: "break_link";
  block: string;
}
/**
 * Type into one cell: of a link, or of the robot where ``link`` is empty.
 */
export interface SetCell {
  kind: "cell";
  link: string;
  column: string;
  text: string;
  angles: "deg" | "rad";
}
/**
 * Draw a wire. With ``replace`` the input's present wire gives way.
 */
export interface Connect {
  kind: "connect";
  wire: Wire;
  replace?: boolean;
}
/**
 * Read the rows by the other convention, or write the same arm in it (``keep_arm``).
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
 * Put blocks into a subsystem of their own; its ports are the wires that are cut thereby.
 */
export interface GroupBlocks {
  kind: "group";
  blocks: string[];
  name: string;
}
/**
 * Take values that were tried in a run, ``block.parameter``, into the model: one step for all of them.
 */
export interface KeepTuned {
  kind: "keep_tuned";
  values: {
    [k: string]: unknown;
  };
}
/**
 * Log an output ``block/port``, so that it is seen without a Scope; or log it no longer.
 */
export interface LogSignal {
  kind: "log";
  port: string;
  logged: boolean;
}
/**
 * Declare the parameters of a subsystem, or of the sheet itself where no block is named, in this order.
 *
 * ``name`` is what its face says; empty leaves that as it is.
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
 * A parameter that a diagram declares. ``default`` as it is typed; ``was``: the name that it had before.
 *
 * ``minimum``, ``above`` and ``maximum`` bound its numbers, ``choices`` are what a choice may be.
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
 * Put blocks and notes elsewhere, or turn blocks: one drag is one edit, however much was in hand.
 *
 * Ways that are drawn between blocks that move alike move with them. ``wires`` are new, and those of
 * ``instead`` give way: a block is put into a wire, or taken out of its wires.
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
 * Words on the sheet: their top left corner in px.
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
 * Let a link of a chain change places with its neighbour.
 */
export interface MoveJoint {
  kind: "move_joint";
  link: string;
  by: -1 | 1;
}
/**
 * Write notes, or change what they say.
 */
export interface SetNotes {
  kind: "notes";
  notes: {
    [k: string]: SheetNote;
  };
}
/**
 * Change parameters of one block. Wires to ports that thereby vanish are removed.
 */
export interface SetParameters {
  kind: "parameters";
  block: string;
  values: {
    [k: string]: unknown;
  };
}
/**
 * Put what was copied on the sheet: ``text`` is a diagram as a file holds it.
 *
 * ``names``: what its blocks and notes are to be called here, where that is not as there. ``shift``: px that
 * they stand further right and down than there.
 */
export interface PasteBlocks {
  kind: "paste";
  text: string;
  names?: {
    [k: string]: string;
  };
  shift?: number;
}
/**
 * Take blocks, wires and notes off the sheet; the wires of the blocks go with them.
 */
export interface RemoveBlocks {
  kind: "remove";
  blocks?: string[];
  wires?: Wire[];
  notes?: string[];
}
/**
 * Remove a link; its child links are attached to its parent.
 */
export interface RemoveJoint {
  kind: "remove_joint";
  link: string;
}
/**
 * Give a block another name; its wires and its place go with it.
 */
export interface Rename {
  kind: "rename";
  block: string;
  name: string;
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
 * Change how the model is run, by the names of ``SimulationOptions``; ``None`` leaves it to armblocks.
 */
export interface SetSettings {
  kind: "settings";
  values: {
    [k: string]: number | string | null;
  };
}
/**
 * Put a document away; ``discard`` where it has edits that no file holds.
 */
export interface Close {
  kind: "close";
  document: string;
  discard?: boolean;
}
/**
 * Say how a run goes on. ``step`` and ``back`` go to the next and to the last recorded instant.
 */
export interface Control {
  run: string;
  kind: "control";
  action: "pause" | "resume" | "step" | "back" | "stop";
}
/**
 * Ask for blocks and notes of a sheet as text, which :class:`PasteBlocks` puts on a sheet again.
 */
export interface Copy {
  kind: "copy";
  document: string;
  inside?: string[];
  blocks: string[];
  notes?: string[];
}
/**
 * Open a file that was dropped on the page: a script, a robot or a diagram. Nothing of it is run.
 */
export interface Drop {
  kind: "drop";
  name: string;
  content: string;
}
/**
 * Ask for the files of the project folder as they are now.
 */
export interface Files {
  kind: "files";
}
/**
 * Ask for blocks of all sheets by words of their names, types and values: a list of :class:`Found`.
 */
export interface Find {
  kind: "find";
  document: string;
  text: string;
}
/**
 * Leave the file that has changed on the disk as it is until the next save, which overwrites it.
 */
export interface KeepMine {
  kind: "keep_mine";
  document: string;
}
/**
 * Look at the sheet inside a subsystem; the empty path is the whole model.
 */
export interface Look {
  kind: "look";
  document: string;
  inside: string[];
}
/**
 * Begin a new document.
 */
export interface New {
  kind: "new";
  document_kind: "diagram" | "robot";
}
/**
 * Open a file of the project: a diagram, a robot, or a script of robots.
 *
 * The reply has the keys of the documents; the first comes to the front.
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
 * Ask for the tree of sheets, an :class:`Outline`.
 */
export interface AskOutline {
  kind: "outline";
  document: string;
}
/**
 * Ask for a drawing of a robot at ``q``, as SVG.
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
 * Ask for nothing but an answer: the page thereby knows that the line is up.
 */
export interface Ping {
  kind: "ping";
}
/**
 * Ask where the base, the links and the tool of a robot are at ``q``: poses (L+2, 4, 4).
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
 * Ask what the robot of a document does at ``q, qd, qdd``.
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
 * Say what becomes of a document that a journal gives back.
 *
 * ``open`` opens it as it was, not yet saved; ``keep_both`` saves it as a new file beside the one it came
 * from and opens that; ``discard`` deletes the journal.
 */
export interface Recover {
  kind: "recover";
  document: string;
  action: "open" | "keep_both" | "discard";
}
/**
 * Do again what was undone.
 */
export interface Redo {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "redo";
}
/**
 * Take what the file holds now, as one step that can be undone.
 */
export interface Reload {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "reload";
}
/**
 * Pause a run and take it back to an instant (s): what came later is forgotten, tuned values stay.
 */
export interface Rewind {
  run: string;
  kind: "rewind";
  time: number;
}
/**
 * Open the robot that a block uses: its file, or a copy of it.
 */
export interface RobotOfBlock {
  kind: "robot_of_block";
  document: string;
  inside?: string[];
  block: string;
}
/**
 * Ask which tables robots have and what stands in their columns.
 */
export interface AskRobotTables {
  kind: "robot_tables";
}
/**
 * Start the model. ``speed`` is simulated seconds per second, ``None`` as fast as possible.
 *
 * ``tuned``: values of tunable parameters, ``block.parameter``, that are tried without being in the model.
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
 * Write the file; ``path`` gives it another. ``overwrite``: also where the disk has changed meanwhile.
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
 * Ask for the bodies of a robot.
 */
export interface AskScene {
  document: string;
  inside?: string[];
  block?: string;
  kind: "scene";
}
/**
 * Change the speed of a run; ``None``: as fast as possible.
 */
export interface SetSpeed {
  run: string;
  kind: "speed";
  speed?: number | null;
}
/**
 * Change a tunable parameter of a run that is under way.
 */
export interface Tune {
  run: string;
  kind: "tune";
  parameter: string;
  value: unknown;
}
/**
 * Ask what a text typed into a parameter's field means: its value, or what is wrong with it.
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
 * Ask what is wrong with settings while they are typed: a text for each that is, by name.
 */
export interface TypedSettings {
  kind: "typed_settings";
  document: string;
  values: {
    [k: string]: number | string | null;
  };
}
/**
 * Take the last edit back.
 */
export interface Undo {
  document: string;
  key?: string;
  base?: number | null;
  author?: string;
  kind: "undo";
}
/**
 * Only for the types of the front end: everything that the server sends as text.
 */
export interface ServerMessage {
  event: Changed | Checked | Documents | Opened | Reply | RunProgress | RunRewound | RunStarted | RunTuned | Welcome;
}
/**
 * A document went from version ``before`` to that of its state, which may be the same.
 */
export interface Changed {
  kind: "changed";
  state: DocumentState;
  before: number;
  change: DiagramChange | RobotChange;
}
/**
 * Where a document stands.
 *
 * ``origin`` is the shipped example or robot that it began as. ``disk`` says how the file is now, compared
 * with what was opened or saved. ``journaled`` is false where the journal cannot be written: then only a
 * save keeps the edits.
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
 * What changed on the sheet that a page looks at, and the settings of the diagram.
 */
export interface DiagramChange {
  kind: "diagram";
  sheet: SheetChange;
  settings: {
    [k: string]: number | string | null;
  };
}
/**
 * From one version of the drawing to the next.
 */
export interface SheetChange {
  blocks: {
    [k: string]: SheetBlock | null;
  };
  wires_added: Wire[];
  wires_removed: Wire[];
  notes?: {
    [k: string]: SheetNote;
  } | null;
  description?: string | null;
  logged?: string[] | null;
}
/**
 * A block as it stands on the sheet. ``face`` is SVG in the block's own px; its colours are classes.
 */
export interface SheetBlock {
  name: string;
  type: string;
  title: string;
  place: Place;
  width: number;
  height: number;
  face: string;
  inputs: PortSpot[];
  outputs: PortSpot[];
  opens: boolean;
  parameters: {
    [k: string]: unknown;
  };
  formulas: {
    [k: string]: string;
  };
  mask: ParameterRule[];
  link: string;
}
/**
 * A port on the edge of its block: px from the block's corner, and the direction of its wire.
 */
export interface PortSpot {
  name: string;
  doc: string;
  label: string;
  unit: string;
  x: number;
  y: number;
  dx: number;
  dy: number;
}
/**
 * One parameter of a type of block, as its dialog needs it.
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
 * A robot after a change: all of it, since one cell may change many.
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
  fields: {
    [k: string]: number | string | null;
  };
  findings: RobotFinding[];
}
/**
 * A link as the tables show it: values by column in SI units, ``None`` where there is none.
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
 * What no real arm could have, at the columns of a link that say it.
 */
export interface RobotFinding {
  link: string;
  columns: string[];
  what: string;
  fix: string;
}
/**
 * What the background check found in one version of a document; ``wires`` by source port.
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
 * What the background check says; ``block`` and ``port`` are ``""`` where it is of the whole drawing.
 */
export interface Finding {
  severity: "error" | "warning";
  block: string;
  port: string;
  what: string;
  fix: string;
}
/**
 * What runs on the wires that leave a port.
 */
export interface WireKind {
  shape: number[];
  unit: string;
  bus?: boolean;
}
/**
 * The documents that are open and those that wait to be recovered, whenever either has changed.
 */
export interface Documents {
  kind: "documents";
  documents: DocumentState[];
  recoveries: Recovery[];
}
/**
 * A document that was not saved when the studio ended, as its journal gives it back.
 *
 * ``path`` is the file that it came from, ``None`` where it never had one. ``began`` and ``last`` are when
 * the first and the last edit since the save were made (s since 1970), ``edits`` how many there are,
 * ``parts`` how many blocks or links it has. ``disk`` says whether the file is still the one that was
 * edited. ``missing`` says what could not be read.
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
 * A whole document, for a page that shows it from now on.
 *
 * ``notes``: what was said when its file was read. ``in_front``: whether it comes to the front of the page.
 */
export interface Opened {
  kind: "opened";
  state: DocumentState;
  content: DiagramContent | RobotContent;
  notes: string[];
  in_front: boolean;
}
/**
 * The sheet of a diagram that a page looks at, and how the diagram is run.
 *
 * ``inside``: names of the subsystems on the way to the sheet. ``settings`` go by the names of
 * ``SimulationOptions``. ``run``: the key of the run that the server has of the diagram.
 */
export interface DiagramContent {
  kind: "diagram";
  inside: string[];
  sheet: Sheet;
  settings: {
    [k: string]: number | string | null;
  };
  run: string | null;
}
/**
 * The whole drawing.
 */
export interface Sheet {
  name: string;
  description: string;
  blocks: {
    [k: string]: SheetBlock;
  };
  wires: Wire[];
  notes: {
    [k: string]: SheetNote;
  };
  logged: string[];
  linked: string[];
  link: string;
}
/**
 * The answer to a request: ``fault`` where it was refused.
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
 * Why a request was refused, in the parts of an ``ArmblocksError``.
 */
export interface Fault {
  what: string;
  where: string;
  allowed: string;
  fix: string;
}
/**
 * Where a run stands. ``solver`` and ``reason`` say at its end what worked it out, and why that.
 */
export interface RunProgress {
  kind: "run_progress";
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
 * A run stands at an earlier instant (s) again: only the first ``count`` samples are still true.
 */
export interface RunRewound {
  kind: "run_rewound";
  run: string;
  time: number;
  count: number;
}
/**
 * A run has begun: what it records and how it is to be shown.
 */
export interface RunStarted {
  kind: "run_started";
  document: string;
  run: string;
  stop_time: number;
  channels: Channel[];
  views: ViewOf[];
  aliases: {
    [k: string]: string;
  };
  tunables: Tunable[];
  stride: number;
}
/**
 * One recorded signal of a run and where its numbers lie in the columns of a frame.
 *
 * ``entries`` are names of the entries of a vector, such as joints; empty where they are numbered.
 */
export interface Channel {
  name: string;
  shape: number[];
  unit: string;
  entries: string[];
}
/**
 * A picture that a sink asks for. ``robot`` is the key of its scene where the kind is ``robot``.
 */
export interface ViewOf {
  block: string;
  kind: string;
  signals: string[];
  labels: string[];
  title: string;
}
/**
 * A parameter that can be changed while the run goes on; ``path`` is ``block.parameter``.
 *
 * ``low`` and ``high`` bound its numbers as the block declares it; ``None`` where nothing does.
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
 * From this instant (s) on a parameter of a run has this value.
 */
export interface RunTuned {
  kind: "run_tuned";
  run: string;
  time: number;
  parameter: string;
  value: unknown;
}
/**
 * The first message: the library, the examples, the files and the documents that are open.
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
 * A type of block in the library palette. ``face`` is the drawing of one with the default parameters.
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
  outputs: string[];
  parameters: ParameterRule[];
}
/**
 * A solver that a model may ask for.
 */
export interface SolverChoice {
  name: string;
  title: string;
  adaptive: boolean;
  stiff: boolean;
}
/**
 * One setting of a run, as the dialog of configuration parameters needs it.
 */
export interface SettingRule {
  name: string;
  title: string;
  unit: string;
  doc: string;
  default: number | string | null;
}
export interface Replies {
  ask_mask: SetMask;
  attach: string;
  change: number;
  close: null;
  control: null;
  copy: string;
  drop: string[];
  files: FileList;
  find: Found[];
  keep_mine: null;
  look: null;
  new: string;
  open: string[];
  open_shipped: string;
  outline: Outline;
  picture: string;
  ping: null;
  pose: number[][][];
  readings: Readings;
  recover: string | null;
  redo: number;
  reload: number;
  rewind: null;
  robot_of_block: string;
  robot_tables: RobotTables;
  run: string;
  save: string;
  scene: RobotScene;
  speed: null;
  tune: null;
  typed: unknown;
  typed_settings: {
    [k: string]: string;
  };
  undo: number;
}
/**
 * Files of the project folder; ``recent`` are those used last, the latest first.
 */
export interface FileList {
  files: string[];
  recent: string[];
}
/**
 * A block that was sought; ``match`` is the value that fits, ``""`` where name or type does.
 */
export interface Found {
  inside: string[];
  name: string;
  title: string;
  match: string;
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
 * What an arm does in one configuration; m, rad, N m, world axes.
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
 * Every column of the tables of robots.
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
 * ``reach`` (m) of the arm; ``foot`` (m): how far the bodies of the base reach below its frame. There are
 * ``rows`` poses: of base, links and tool.
 */
export interface RobotScene {
  name: string;
  reach: number;
  foot: number;
  rows: number;
  bodies: SceneBody[];
  joints: SceneJoint[];
  [k: string]: unknown;
}
/**
 * A body of a robot, which moves with a ``row`` of the poses: 0 is the base, then come the links.
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
 * A joint: the link of ``row`` moves against that of ``carrier``.
 *
 * ``frame`` is its pose in the frame of ``carrier`` and ``moving`` its pose in the link's own frame, (16,)
 * row by row; z is the joint's axis. The x of ``moving`` has turned from that of ``frame`` by q + ``offset``
 * (of a prismatic joint: its origin has moved so far). ``limits`` are in rad or m, ``radius`` (m) is that of
 * the drum that is drawn on the joint.
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
