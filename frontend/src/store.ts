import { create } from 'zustand'
import { Connection, Refusal, type EventOf, type Line, type Request, type ServerEvent } from './connection'
import { lastShown, remember } from './documents/last_shown'
import { changed as viewsChanged } from './frames'
import { newKey } from './keys'
import type {
  BlockType,
  Channel,
  Checked,
  DocumentState,
  Envelope,
  Fault,
  Finding,
  Recovery,
  SheetBlock,
  SheetNote,
  Tunable,
  ViewOf,
  Wire,
  WireKind,
} from './protocol'
import { attachAgain, leaveEditor, robotOpened, robotShown } from './robot/editor/desk'
import { isFree } from './run/pace'
import * as runs from './run/runs'
import { samples } from './samples'

export type Edit = Extract<Envelope['request'], { kind: 'change' }>['edit']

/** The document on the screen: what the server last said of it. */
export interface OpenDocument {
  state: DocumentState
  /** Names of the subsystems on the way to the sheet on the screen. */
  inside: string[]
  name: string
  description: string
  blocks: Record<string, SheetBlock>
  wires: Wire[]
  notes: Record<string, SheetNote>
  /** The library block that the sheet belongs to, by its path; empty for a sheet of one's own. */
  linked: string[]
  link: string
  logged: string[]
  findings: Finding[]
  wireKinds: Record<string, WireKind>
}

export interface RunView {
  run: string
  state: 'running' | 'paused' | 'done' | 'stopped' | 'failed'
  time: number
  stopTime: number
  realTimeFactor: number
  message: string
  fault: Fault | null
  /** What worked it out and why that: known at the end. */
  solver: string
  reason: string
  channels: Channel[]
  views: ViewOf[]
  aliases: Record<string, string>
  tunables: Tunable[]
}

export interface Notice {
  id: number
  what: string
  fix: string
}

interface Studio {
  line: Line
  /** What the server has open, and what it offers to recover. */
  documents: DocumentState[]
  recoveries: Recovery[]
  /** Whether this page has come back to what it showed: then it is not stopped by what others lost. */
  returned: boolean
  welcome: EventOf<'welcome'> | null
  library: Map<string, BlockType>
  document: OpenDocument | null
  run: RunView | null
  selection: ReadonlySet<string>
  editing: string | null
  /** A block that is to be brought into the middle of the window. */
  sought: string | null
  notices: Notice[]
  select: (names: Iterable<string>) => void
  edit: (block: string | null) => void
  dismiss: (id: number) => void
}

export const useStudio = create<Studio>((set) => ({
  line: 'down',
  documents: [],
  recoveries: [],
  returned: false,
  welcome: null,
  library: new Map(),
  document: null,
  run: null,
  selection: new Set(),
  editing: null,
  sought: null,
  notices: [],
  select: (names) => set({ selection: new Set(names) }),
  edit: (editing) => set({ editing }),
  dismiss: (id) => set((s) => ({ notices: s.notices.filter((notice) => notice.id !== id) })),
}))
useStudio.subscribe(viewsChanged)

const wireKey = (wire: Wire) => `${wire.source} -> ${wire.target}`

function changed(document: OpenDocument, event: EventOf<'changed'>): OpenDocument {
  const { change, state } = event
  const blocks = { ...document.blocks }
  for (const [name, block] of Object.entries(change.blocks)) {
    if (block) blocks[name] = block
    else delete blocks[name]
  }
  const removed = new Set(change.wires_removed.map(wireKey))
  return {
    ...document,
    state,
    blocks,
    name: document.inside.length ? document.name : state.title,
    wires: [...document.wires.filter((wire) => !removed.has(wireKey(wire))), ...change.wires_added],
    notes: change.notes ?? document.notes,
    description: change.description ?? document.description,
    logged: change.logged ?? document.logged,
  }
}

function checked(document: OpenDocument, event: Checked): OpenDocument {
  if (event.version !== document.state.version) return document
  // While something is wrong nothing new is known of the wires; what was known still helps the eye.
  const wireKinds = event.findings.length ? document.wireKinds : event.wires
  return { ...document, findings: event.findings, wireKinds }
}

function receive(event: ServerEvent): void {
  const { document, run } = useStudio.getState()
  switch (event.kind) {
    case 'welcome': {
      useStudio.setState({
        welcome: event,
        library: new Map(event.library.map((kind) => [kind.type, kind])),
        documents: event.documents,
      })
      void showAgain(event).then(() => useStudio.setState({ recoveries: event.recoveries }))
      break
    }
    case 'documents':
      useStudio.setState({ documents: event.documents, recoveries: event.recoveries })
      break
    case 'opened': {
      const { state, sheet, inside } = event
      const same = document?.state.document === state.document
      const moved = same && document.inside.join('/') !== inside.join('/')
      if (moved) useStudio.setState({ selection: new Set<string>(), editing: null })
      if (same && run && (run.state === 'running' || run.state === 'paused') && event.run !== run.run)
        useStudio.setState({ run: { ...run, state: 'failed', message: 'The studio ended during this run.' } })
      useStudio.setState({
        document: {
          state,
          inside,
          ...sheet,
          findings: same ? document.findings : [],
          wireKinds: same ? document.wireKinds : {},
        },
        ...(same ? {} : { run: null, selection: new Set<string>(), editing: null }),
      })
      if (!same) {
        runs.forget()
        leaveEditor()
      }
      remember(state, inside)
      break
    }
    case 'changed':
      if (document?.state.document !== event.state.document) break
      if (event.before !== document.state.version && event.state.version !== document.state.version)
        void ask({ kind: 'look', document: event.state.document, inside: document.inside })
      else {
        useStudio.setState({ document: changed(document, event) })
        remember(event.state, document.inside)
      }
      break
    case 'checked':
      if (document?.state.document === event.document) useStudio.setState({ document: checked(document, event) })
      break
    case 'run_started':
      if (run?.run === event.run) break // told again after the line was down: its samples are the same
      runs.began(event)
      useStudio.setState({
        run: {
          run: event.run,
          state: 'running',
          time: 0,
          stopTime: event.stop_time,
          realTimeFactor: 0,
          message: '',
          fault: null,
          solver: '',
          reason: '',
          channels: event.channels,
          views: event.views,
          aliases: event.aliases,
          tunables: event.tunables,
        },
      })
      break
    case 'run_tuned':
      runs.tuned(event)
      break
    case 'run_rewound':
      runs.rewound(event)
      break
    case 'run_progress':
      runs.progressed(event)
      // How far a run that goes on has come may wait; what else is told of it may not.
      if (run?.run === event.run && (event.state !== 'running' || run.state !== 'running' || isFree(performance.now())))
        useStudio.setState({
          run: {
            ...run,
            state: event.state,
            time: event.time,
            realTimeFactor: event.real_time_factor,
            message: event.message,
            fault: event.fault ?? null,
            solver: event.solver ?? '',
            reason: event.reason ?? '',
          },
        })
      if (event.fault) refuse(event.fault)
      break
    case 'robot':
      robotShown(event)
      break
    case 'robot_opened':
      robotOpened(event.opening)
      break
    case 'reply':
      break
  }
}

/** Show the document that this page showed before, or else what its address names; then let requests flow. */
async function showAgain(welcome: EventOf<'welcome'>): Promise<void> {
  const robot = await attachAgain()
  await showDocumentAgain(welcome)
  if (robot) robotOpened(robot)
}

async function showDocumentAgain(welcome: EventOf<'welcome'>): Promise<void> {
  const shown = useStudio.getState().document
  const last = shown ? { ...shown.state, inside: shown.inside } : lastShown()
  if (last) {
    const { document, inside, path, example } = last
    useStudio.setState({ returned: true })
    const found = await ask<string>({ kind: 'attach', document, inside, path, example })
    if (found !== undefined) {
      line.resend()
      return
    }
    useStudio.setState({ returned: false })
  }
  line.resend()
  if (!shown) await openFromAddress(welcome)
}

async function openFromAddress(welcome: EventOf<'welcome'>): Promise<void> {
  const wanted = decodeURIComponent(location.hash.slice(1))
  if (wanted) {
    const found = await ask(wanted in welcome.examples ? { kind: 'open', example: wanted } : { kind: 'open', path: wanted })
    if (found !== undefined) return
  }
  const open = welcome.documents[0]
  await ask(open ? { kind: 'attach', document: open.document } : { kind: 'open', example: 'kr180model' })
}

export const line = new Connection(
  receive,
  (frame) => samples.receive(frame),
  (state) => useStudio.setState({ line: state }),
  (reason) => refuse(reason),
)

let notices = 0

/** Show what was refused, or why a run ended, in words. */
export function refuse({ what, where, fix }: Pick<Fault, 'what' | 'where' | 'fix'>): void {
  const notice = { id: ++notices, what: where ? `${where}: ${what}` : what, fix }
  useStudio.setState((s) => ({ notices: [...s.notices.slice(-4), notice] }))
}

/** Ask the server; a refusal becomes a notice, and the promise then gives undefined. */
export async function ask<T = unknown>(request: Request): Promise<T | undefined> {
  try {
    return await line.ask<T>(request)
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    refuse(error)
    return undefined
  }
}

/** By what the server tells the edits of this page from those of others. */
export const author = newKey()

/** What goes with everything that changes a drawing: which, what of it this page saw, and a key to do it once. */
function alteration(document: OpenDocument) {
  return { document: document.state.document, key: newKey(), base: document.state.version, author }
}

/** Carry out an edit of the document on the screen; where it is refused the sheet is shown as it is. */
export async function change(edit: Edit): Promise<unknown> {
  const { document } = useStudio.getState()
  if (!document) return undefined
  const { inside } = document
  const version = await ask({ kind: 'change', ...alteration(document), inside, edit })
  if (version === undefined) look(inside)
  return version
}

/** Carry out an edit of the sheet at a path of subsystems; a refusal is thrown to who asks. */
export async function attempt(edit: Edit, inside: string[]): Promise<void> {
  const { document } = useStudio.getState()
  if (document) await line.ask({ kind: 'change', ...alteration(document), inside, edit })
}

/** Take the last step back, do it again, or lay the blocks of this sheet out anew. */
export function alter(kind: 'undo' | 'redo' | 'arrange'): void {
  const { document } = useStudio.getState()
  if (!document) return
  const common = alteration(document)
  void ask(kind === 'arrange' ? { kind, ...common, inside: document.inside } : { kind, ...common })
}

/** Look at the sheet inside a subsystem; the empty path is the whole model. */
export function look(inside: string[]): void {
  const document = useStudio.getState().document
  if (document) void ask({ kind: 'look', document: document.state.document, inside })
}

/** Show a block: its sheet, with it selected. */
export async function showBlock(inside: string[], name: string): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  if (document.inside.join('/') !== inside.join('/')) await ask({ kind: 'look', document: document.state.document, inside })
  useStudio.setState({ selection: new Set([name]), sought: name })
}

/** A name for a new block that no other has: "Gain", "Gain 2", … */
export function freeName(wish: string, taken: Iterable<string>): string {
  const folded = new Set([...taken].map((name) => name.toLowerCase()))
  if (!folded.has(wish.toLowerCase())) return wish
  const stem = wish.replace(/ \d+$/, '')
  for (let k = 2; ; k++) if (!folded.has(`${stem} ${k}`.toLowerCase())) return `${stem} ${k}`
}
