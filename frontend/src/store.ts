import { create } from 'zustand'
import { Connection, Refusal, type Line } from './connection'
import { changed as viewsChanged } from './frames'
import { newKey } from './keys'
import type { Edit, EventOf, ReplyTo, Request } from './messages'
import type {
  BlockType,
  Channel,
  DocumentState,
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
import { samples } from './samples'

/** The diagram on the screen: what the server last said of it. */
export interface OpenDocument {
  state: DocumentState
  /** How it is run, by the names of `SimulationOptions`. */
  settings: Record<string, number | string | null>
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

/** The line to the server; `events.ts` says what happens when the server tells something. */
export const line = new Connection(
  (frame) => {
    samples.receive(frame)
    viewsChanged()
  },
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
export async function ask<R extends Request>(request: R): Promise<ReplyTo<R> | undefined> {
  try {
    return await line.ask(request)
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    refuse(error)
    return undefined
  }
}

/** By what the server tells the edits of this page from those of others. */
export const author = newKey()

/** What goes with every change of a document: which, what this page saw of it, and a key to do it once. */
export function alteration({ document, version }: DocumentState) {
  return { document, key: newKey(), base: version, author }
}

/** Carry out an edit of the diagram on the screen; where it is refused the sheet is shown as it is. */
export async function change(edit: Edit): Promise<number | undefined> {
  const { document } = useStudio.getState()
  if (!document) return undefined
  const { inside, state } = document
  const version = await ask({ kind: 'change', ...alteration(state), inside, edit })
  if (version === undefined) look(inside)
  return version
}

/** Carry out an edit of the sheet at a path of subsystems; a refusal is thrown to who asks. */
export async function attempt(edit: Edit, inside: string[]): Promise<void> {
  const { document } = useStudio.getState()
  if (document) await line.ask({ kind: 'change', ...alteration(document.state), inside, edit })
}

/** Take the last step of a document back, do it again, or take what its file holds now. */
export function alter(
  kind: 'undo' | 'redo' | 'reload',
  of: DocumentState | undefined = useStudio.getState().document?.state,
): void {
  if (of) void ask({ kind, ...alteration(of) })
}

/** Bring a document that the server has open to the front of this page. */
export function bringToFront({ document, kind, path, origin }: DocumentState): Promise<string | undefined> {
  return ask({ kind: 'attach', document, document_kind: kind, path, origin })
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
  if (document.inside.join('/') !== inside.join('/'))
    await ask({ kind: 'look', document: document.state.document, inside })
  useStudio.setState({ selection: new Set([name]), sought: name })
}

/** A name for a new block that no other has: "Gain", "Gain 2", … */
export function freeName(wish: string, taken: Iterable<string>): string {
  const folded = new Set([...taken].map((name) => name.toLowerCase()))
  if (!folded.has(wish.toLowerCase())) return wish
  const stem = wish.replace(/ \d+$/, '')
  for (let k = 2; ; k++) if (!folded.has(`${stem} ${k}`.toLowerCase())) return `${stem} ${k}`
}
