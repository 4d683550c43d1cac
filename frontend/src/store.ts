import { create } from 'zustand'
import { Connection, Refusal, type ConnectionState } from './connection'
import { scheduleFrame } from './frames'
import { holdKeys, setConnected } from './held_keys'
import { newKey } from './keys'
import { outstandingMoves, pathOf, withMoves, type SentMove } from './model/sent_moves'
import type { Edit, EventOf, ReplyTo, Request } from './messages'
import type {
  BlockType,
  Channel,
  DocumentState,
  Fault,
  Finding,
  OuterComment,
  Recovery,
  ScopeTriggerSettings,
  SheetBlock,
  SheetNote,
  Tunable,
  SinkView,
  Wire,
  WireKind,
  WireLines,
} from './protocol'
import { receiveFrame } from './run/runs'

/** The displayed diagram, in the last state sent by the server. */
export interface OpenDocument {
  state: DocumentState
  /** The run settings, by the names of `SimulationOptions`. */
  settings: Record<string, boolean | number | string | null>
  /** The trigger of the scopes; null: the default. */
  scopeTrigger: ScopeTriggerSettings | null
  /** Names of the subsystems that lead to the displayed sheet. */
  inside: string[]
  name: string
  description: string
  blocks: Record<string, SheetBlock>
  wires: Wire[]
  /** The lines of the wires, by output. */
  lines: Record<string, WireLines>
  notes: Record<string, SheetNote>
  /** Path of the library block that contains the sheet; empty if the sheet is not in a library block. */
  linked: string[]
  /** The commented subsystem that contains the sheet. */
  outerComment: OuterComment | null
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
  /** The solver that was used and the reason for its choice, known at the end. */
  solver: string
  reason: string
  channels: Channel[]
  views: SinkView[]
  aliases: Record<string, string>
  tunables: Tunable[]
}

export interface Notice {
  id: number
  what: string
  fix: string
}

interface Studio {
  connectionState: ConnectionState
  /** The open and the recoverable documents of the server. */
  documents: DocumentState[]
  recoveries: Recovery[]
  /** Whether this client has reopened its document; it then shows no recovery dialog for other documents. */
  returned: boolean
  welcome: EventOf<'welcome'> | null
  library: Map<string, BlockType>
  document: OpenDocument | null
  /** Moves of this client that the displayed state of the server does not contain yet. */
  sent: SentMove[]
  run: RunView | null
  selection: ReadonlySet<string>
  editing: string | null
  /** A block that is to be centred in the window. */
  blockToCentre: string | null
  notices: Notice[]
  /** Whether the last run failed; unconnected inputs are then shown as errors instead of warnings. */
  strict: boolean
  select: (names: Iterable<string>) => void
  edit: (block: string | null) => void
  dismiss: (id: number) => void
}

export const useStudio = create<Studio>((set) => ({
  connectionState: 'down',
  documents: [],
  recoveries: [],
  returned: false,
  welcome: null,
  library: new Map(),
  document: null,
  sent: [],
  run: null,
  selection: new Set(),
  editing: null,
  blockToCentre: null,
  notices: [],
  strict: false,
  select: (names) => set({ selection: new Set(names) }),
  edit: (editing) => set({ editing }),
  dismiss: (id) => set((s) => ({ notices: s.notices.filter((notice) => notice.id !== id) })),
}))
useStudio.subscribe(scheduleFrame)

/** The connection to the server; `events.ts` handles its events. */
export const connection = new Connection(
  (frame) => {
    receiveFrame(frame)
    scheduleFrame()
  },
  (state) => {
    useStudio.setState({ connectionState: state })
    setConnected(state === 'up')
  },
  (refusal) => refuse(refusal),
)

let notices = 0

/** Show a notice for a refused request or a failed run. */
export function refuse({ what, where, fix }: Pick<Fault, 'what' | 'where' | 'fix'>): void {
  const notice = { id: ++notices, what: where ? `${where}: ${what}` : what, fix }
  useStudio.setState((s) => {
    const others = s.notices.filter((one) => one.what !== notice.what || one.fix !== fix)
    return { notices: [...others.slice(-4), notice] }
  })
}

/** Send a request; a refusal is shown as a notice, and the promise then resolves to undefined. */
export async function ask<R extends Request>(request: R): Promise<ReplyTo<R> | undefined> {
  try {
    return await connection.ask(request)
  } catch (error) {
    if (!(error instanceof Refusal)) throw error
    refuse(error)
    return undefined
  }
}

/** Identifies the edits of this client. */
export const author = newKey()

/** The common fields of all changes of a document: document, displayed version, author and unique key. */
export function alteration({ document, version }: DocumentState) {
  return { document, key: newKey(), base: version, author }
}

/**
 * Apply an edit to the displayed diagram; if it is refused, the sheet is restored. Moves are shown before the
 * reply, so that the next move starts from the new positions.
 */
export async function change(edit: Edit): Promise<number | undefined> {
  const { document } = useStudio.getState()
  if (!document) return undefined
  const { inside, state } = document
  const request = { kind: 'change' as const, ...alteration(state), inside, edit }
  if (edit.kind !== 'move') {
    const version = await holdKeys(ask(request))
    if (version === undefined) openSheet(inside)
    return version
  }
  const { places = {}, notes = {} } = edit
  const { key } = request
  showMove({ key, document: state.document, inside: pathOf(inside), version: null, places, notes })
  const version = await ask(request)
  useStudio.setState((s) => ({
    sent: s.sent.flatMap((sentMove) =>
      sentMove.key !== key
        ? [sentMove]
        : version === undefined || version <= (s.document?.state.version ?? 0)
          ? []
          : [{ ...sentMove, version }],
    ),
  }))
  if (version === undefined) openSheet(inside)
  return version
}

function showMove(move: SentMove): void {
  useStudio.setState((s) => ({
    sent: [...s.sent, move],
    document: s.document && withMoves(s.document, [move]),
  }))
}

/** Show a state of the document from the server, with the moves that it does not contain yet. */
export function showState(document: OpenDocument): Pick<Studio, 'document' | 'sent'> {
  const sent = outstandingMoves(useStudio.getState().sent, document)
  return { document: withMoves(document, sent), sent }
}

/** Apply an edit to the sheet at a path of subsystems; a refusal is thrown to the caller. */
export async function attempt(edit: Edit, inside: string[]): Promise<void> {
  const { document } = useStudio.getState()
  if (document)
    await holdKeys(connection.ask({ kind: 'change', ...alteration(document.state), inside, edit }))
}

/** Undo or redo a step of a document, or reload its file. */
export function alterDocument(
  kind: 'undo' | 'redo' | 'reload',
  state: DocumentState | undefined = useStudio.getState().document?.state,
): void {
  if (state) void holdKeys(ask({ kind, ...alteration(state) }))
}

/** Show a document that the server has open. */
export function bringToFront({ document, kind, path, origin }: DocumentState): Promise<string | undefined> {
  return holdKeys(ask({ kind: 'attach', document, document_kind: kind, path, origin }))
}

/** Show the sheet inside a subsystem; the empty path is the top sheet. */
export function openSheet(inside: string[]): void {
  const document = useStudio.getState().document
  if (document) void holdKeys(ask({ kind: 'show_sheet', document: document.state.document, inside }))
}

/** Show the sheet of a block and select the block. */
export async function showBlock(inside: string[], name: string): Promise<void> {
  const { document } = useStudio.getState()
  if (!document) return
  if (document.inside.join('/') !== inside.join('/'))
    await ask({ kind: 'show_sheet', document: document.state.document, inside })
  useStudio.setState({ selection: new Set([name]), blockToCentre: name })
}

/** Select the result of an edit, unless the user has selected something else since the edit was sent. */
export function selectIfUnchanged(before: ReadonlySet<string>, names: Iterable<string>): void {
  const { selection, select } = useStudio.getState()
  // A block that gets the focus back after a dialog is selected again: the same names in a new set.
  if (selection.size === before.size && [...selection].every((name) => before.has(name))) select(names)
}

/** The names of the blocks and signals of the visible sheet, which a new block cannot have. */
export function namesInUse(): string[] {
  const { blocks = {}, lines = {} } = useStudio.getState().document ?? {}
  return [...Object.keys(blocks), ...Object.values(lines).flatMap(({ name }) => (name ? [name] : []))]
}

/** An unused name for a new block: "Gain", "Gain 2", … */
export function freeName(preferred: string, names: Iterable<string>): string {
  const folded = new Set([...names].map((name) => name.toLowerCase()))
  if (!folded.has(preferred.toLowerCase())) return preferred
  const stem = preferred.replace(/ \d+$/, '')
  for (let k = 2; ; k++) if (!folded.has(`${stem} ${k}`.toLowerCase())) return `${stem} ${k}`
}
