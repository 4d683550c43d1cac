import {
  changeStoredRun,
  restoreView,
  storeRun,
  storeView,
  updateStoredRun,
} from './documents/document_views'
import { lastShown, storeShown } from './documents/last_shown'
import { addTab, reattachTabs } from './documents/tabs'
import type { ChangeOf, ContentOf, DocumentKind, EventOf, ServerEvent } from './messages'
import type { Checked, DocumentState, Fault, Wire } from './protocol'
import { reattachRobots, leaveEditor, robotChanged, robotOpened, showRobot } from './robot/editor/state'
import { canDraw } from './run/pace'
import { onBlocksRenamed, onRunRenamed, runViewAfter } from './run/renames'
import * as runs from './run/runs'
import { recoverable } from './model/recoverable'
import {
  ask,
  bringToFront,
  connection,
  refuse,
  showState,
  useStudio,
  type OpenDocument,
  type RunView,
} from './store'

const wireKey = (wire: Wire) => `${wire.source} -> ${wire.target}`

function withChange(document: OpenDocument, state: DocumentState, change: ChangeOf<'diagram'>): OpenDocument {
  const { sheet, settings, scope_trigger: scopeTrigger } = change
  const blocks = { ...document.blocks }
  for (const [name, block] of Object.entries(sheet.blocks)) {
    if (block) blocks[name] = block
    else delete blocks[name]
  }
  const removed = new Set(sheet.wires_removed.map(wireKey))
  const lines = { ...document.lines }
  for (const [source, wireLines] of Object.entries(sheet.lines)) {
    if (wireLines) lines[source] = wireLines
    else delete lines[source]
  }
  return {
    ...document,
    state,
    settings,
    scopeTrigger,
    blocks,
    name: document.inside.length ? document.name : state.title,
    wires: [...document.wires.filter((wire) => !removed.has(wireKey(wire))), ...sheet.wires_added],
    lines,
    notes: sheet.notes ?? document.notes,
    description: sheet.description ?? document.description,
    outerComment: change.outer_comment,
    logged: sheet.logged ?? document.logged,
  }
}

function withFindings(document: OpenDocument, event: Checked): OpenDocument {
  if (event.version !== document.state.version) return document
  // With an error in the diagram no new signal types are known; the previous ones remain displayed.
  const wireKinds = event.findings.length ? document.wireKinds : event.wires
  return { ...document, findings: event.findings, wireKinds }
}

/** The changes of the state for each event of the server. */
const EVENT_HANDLERS: { [Kind in ServerEvent['kind']]: (event: EventOf<Kind>) => void } = {
  welcome,
  documents: ({ documents, recoveries }) =>
    useStudio.setState({ documents, recoveries: recoverable(recoveries, documents) }),
  opened: (event) => opened(event, event.content),
  changed: documentChanged,
  checked: documentChecked,
  run_started: runStarted,
  run_tuned: runs.onRunTuned,
  run_rewound: runs.onRunRewound,
  run_renamed: runRenamed,
  run_progress: runProgressed,
  reply: () => {},
}

/** The changes of the state when a document of each kind is opened. */
const OPEN_HANDLERS: {
  [Kind in DocumentKind]: (event: EventOf<'opened'>, content: ContentOf<Kind>) => void
} = {
  diagram: diagramOpened,
  robot: robotOpened,
}

/** The changes of the state when a document of each kind changes. */
const CHANGE_HANDLERS: {
  [Kind in DocumentKind]: (event: EventOf<'changed'>, change: ChangeOf<Kind>) => void
} = {
  diagram: diagramChanged,
  robot: robotChanged,
}

/** Update the state after an event of the server. */
export function receive<Kind extends ServerEvent['kind']>(event: EventOf<Kind> & { kind: Kind }): void {
  EVENT_HANDLERS[event.kind](event)
}

function welcome(event: EventOf<'welcome'>): void {
  useStudio.setState({
    welcome: event,
    library: new Map(event.library.map((kind) => [kind.type, kind])),
    documents: event.documents,
  })
  // Set after the documents are restored: a restored document is not offered for recovery.
  void restoreDocuments(event).then(() =>
    useStudio.setState((s) => ({ recoveries: recoverable(event.recoveries, s.documents) })),
  )
}

function opened<Kind extends DocumentKind>(
  event: EventOf<'opened'>,
  content: ContentOf<Kind> & { kind: Kind },
): void {
  OPEN_HANDLERS[content.kind](event, content)
  if (event.in_front) addTab(event.state)
}

function diagramOpened({ state, in_front }: EventOf<'opened'>, content: ContentOf<'diagram'>): void {
  const { document, run } = useStudio.getState()
  const { sheet, inside, settings, scope_trigger: scopeTrigger } = content
  const isShown = document?.state.document === state.document
  // Without a shown diagram, the next one is shown behind the robot editor.
  if (!isShown && !in_front && document) return
  const otherSheet = isShown && document.inside.join('/') !== inside.join('/')
  if (otherSheet) useStudio.setState({ selection: new Set<string>(), editing: null })
  if (isShown && run && (run.state === 'running' || run.state === 'paused') && content.run !== run.run)
    useStudio.setState({ run: { ...run, state: 'failed', message: 'The studio ended during this run.' } })
  if (!isShown) storeView()
  const shown = {
    state,
    inside,
    settings,
    scopeTrigger,
    ...sheet,
    outerComment: content.outer_comment,
    findings: isShown ? document.findings : [],
    wireKinds: isShown ? document.wireKinds : {},
  }
  if (!isShown) restoreView(shown, content.run)
  useStudio.setState({
    ...showState(shown),
    // Notices about another document are outdated.
    ...(isShown || !document ? {} : { notices: [] }),
  })
  if (!isShown && in_front) leaveEditor()
  storeShown(state, inside)
}

function documentChanged(event: EventOf<'changed'>): void {
  const { state, change } = event
  useStudio.setState((s) => ({
    documents: s.documents.map((known) => (known.document === state.document ? state : known)),
  }))
  contentChanged(event, change)
}

function contentChanged<Kind extends DocumentKind>(
  event: EventOf<'changed'>,
  change: ChangeOf<Kind> & { kind: Kind },
): void {
  CHANGE_HANDLERS[change.kind](event, change)
}

function diagramChanged(event: EventOf<'changed'>, change: ChangeOf<'diagram'>): void {
  const { document } = useStudio.getState()
  if (document?.state.document !== event.state.document) return
  if (event.before !== document.state.version && event.state.version !== document.state.version)
    void ask({ kind: 'show_sheet', document: event.state.document, inside: document.inside })
  else {
    useStudio.setState(showState(withChange(document, event.state, change)))
    const { renamed = {} } = change
    if (Object.keys(renamed).length) onBlocksRenamed(event.state.document, document.inside, renamed)
    storeShown(event.state, document.inside)
  }
}

function documentChecked(event: EventOf<'checked'>): void {
  const { document } = useStudio.getState()
  if (document?.state.document === event.document)
    useStudio.setState({ document: withFindings(document, event) })
}

function runStarted(event: EventOf<'run_started'>): void {
  // After a reconnection the server sends the same event again.
  const { run, document } = useStudio.getState()
  if (run?.run === event.run) {
    // Renames of blocks follow, as after the first time.
    const { channels, views, aliases, tunables } = event
    runs.restoreSignalNames(event)
    useStudio.setState({ run: { ...run, channels, views, aliases, tunables } })
    return
  }
  const displayed = document?.state.document === event.document
  runs.onRunStarted(event, displayed)
  const started: RunView = {
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
  }
  if (displayed) useStudio.setState({ strict: false, notices: [], run: started })
  else storeRun(event.document, started)
}

function runRenamed(event: EventOf<'run_renamed'>): void {
  onRunRenamed(event)
  const { run } = useStudio.getState()
  if (run?.run === event.run) useStudio.setState({ run: runViewAfter(run, event.renamed) })
  else changeStoredRun(event.run, (stored) => runViewAfter(stored, event.renamed))
}

function runProgressed(event: EventOf<'run_progress'>): void {
  const { run, document } = useStudio.getState()
  runs.onRunProgress(event)
  const progress: Partial<RunView> = {
    state: event.state,
    time: event.time,
    realTimeFactor: event.real_time_factor,
    message: event.message,
    fault: event.fault ?? null,
    solver: event.solver ?? '',
    reason: event.reason ?? '',
  }
  if (event.document !== document?.state.document) {
    updateStoredRun(event, progress)
    if (event.fault) refuseInTab(event.document, event.fault)
    return
  }
  // The progress of a run may be displayed later; other messages of a run are handled at once.
  if (
    run?.run === event.run &&
    (event.state !== 'running' || run.state !== 'running' || canDraw(performance.now()))
  )
    useStudio.setState({ run: { ...run, ...progress } })
  if (!event.fault) return
  useStudio.setState({ strict: true })
  refuse(event.fault)
}

/** Show a notice for a failed run of a diagram in another tab, with the title of the diagram. */
function refuseInTab(document: string, fault: Fault): void {
  const title = useStudio.getState().documents.find((known) => known.document === document)?.title
  refuse({ ...fault, where: [title, fault.where].filter(Boolean).join(' › ') })
}

/** Reopen the last document of this client, or the one in its address; then send the pending requests. */
async function restoreDocuments(welcome: EventOf<'welcome'>): Promise<void> {
  const robot = await reattachRobots()
  await restoreDiagram(welcome)
  if (robot) showRobot(robot)
}

async function restoreDiagram(welcome: EventOf<'welcome'>): Promise<void> {
  const displayed = useStudio.getState().document
  const last = displayed ? { ...displayed.state, inside: displayed.inside } : lastShown()
  if (last) {
    const { document, inside, path, origin } = last
    useStudio.setState({ returned: true })
    const key = await ask({ kind: 'attach', document, document_kind: 'diagram', inside, path, origin })
    if (key !== undefined) {
      // The tabs are restored before `resend`, because pending requests may belong to their documents.
      await reattachTabs(welcome)
      connection.resend()
      return
    }
    useStudio.setState({ returned: false })
  }
  await reattachTabs(welcome)
  connection.resend()
  if (!displayed) await openFromAddress(welcome)
}

async function openFromAddress(welcome: EventOf<'welcome'>): Promise<void> {
  const name = decodeURIComponent(location.hash.slice(1))
  if (name) {
    const opened = await ask(
      name in welcome.examples
        ? { kind: 'open_shipped', document_kind: 'diagram', name }
        : { kind: 'open', path: name },
    )
    // After a refusal, no other model is opened: an empty diagram offers the examples.
    if (opened === undefined) await ask({ kind: 'new', document_kind: 'diagram' })
    return
  }
  const open = welcome.documents.find(({ kind }) => kind === 'diagram')
  if (open) await bringToFront(open)
  else await ask({ kind: 'open_shipped', document_kind: 'diagram', name: 'kr180model' })
}
