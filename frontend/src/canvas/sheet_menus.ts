import { commands } from '../commands'
import { openMenu, type Entries, type Entry } from '../context_menu_state'
import { showDialog } from '../dialogs'
import { showScope } from '../dock'
import { blockOf, isFrame, portOf, wireKey } from '../model/wires'
import type { SheetBlock, Wire } from '../protocol'
import { useShownValues } from '../run/shown_values'
import { change, openSheet, useStudio, type OpenDocument } from '../store'
import { selectedBlocks, setColour, setNameSide } from './arranging'
import { pasteAt } from './clipboard'
import { sheetPointAt } from './insert'
import { editNote, createNote } from './note_node'
import { nodeNameAt, wireKeyAt } from './pointer_buttons'
import { hasChart } from './sheet_actions'
import { removeSelected } from './sheet_keys'
import { portSides } from './sheet_layout'
import { nameSignal } from './signal_names'

type Point = { x: number; y: number }

/** Open the context menu of an element of the sheet: a port, block, note, wire, or the sheet itself. */
export function openSheetMenu(point: Point, element: Element, selectWire: (key: string) => void): void {
  const { document, selection, select } = useStudio.getState()
  if (!document) return
  const handle = element.closest('.react-flow__handle')
  const node = nodeNameAt(element)
  const wire = document.wires.find((candidate) => wireKey(candidate) === wireKeyAt(element))
  if (node && handle) {
    const port = `${node}/${handle.getAttribute('data-handleid')}`
    openMenu(port, point, portEntries(document, port, handle.classList.contains('source'), point))
  } else if (node) {
    if (!selection.has(node)) select([node])
    const block = document.blocks[node]
    openMenu(block?.name ?? 'Note', point, block ? blockEntries(document, block) : noteEntries(node))
  } else if (wire) {
    selectWire(wireKey(wire))
    const title = `${isFrame(document.blocks, wire.source) ? 'Frame of' : 'Wire from'} ${wire.source}`
    openMenu(title, point, wireEntries(document, wire, point))
  } else openMenu('Sheet', point, sheetEntries(document, point))
}

/** A command as an entry. */
function commandEntry(title: string): Entry {
  const command = commands().find((candidate) => candidate.title === title)
  if (!command) throw new Error(`There is no command "${title}".`)
  return { title, keys: command.keys, enabled: command.enabled?.() ?? true, run: command.run }
}

function sheetEntries(document: OpenDocument, point: Point): Entries {
  return [
    { title: 'Add a block here …', run: () => showDialog('insert', '', point) },
    { title: 'Write a note here', run: () => createNote(sheetPointAt(point).x, sheetPointAt(point).y) },
    { title: 'Paste here', run: () => void pasteAt(sheetPointAt(point)) },
    commandEntry('Select all'),
    null,
    { ...commandEntry('Undo'), enabled: Boolean(document.state.undo) },
    { ...commandEntry('Redo'), enabled: Boolean(document.state.redo) },
    null,
    commandEntry('Arrange the sheet'),
    commandEntry('Ground and terminate unconnected ports'),
    commandEntry('Fit the sheet into the window'),
    commandEntry('Show the sheet at 100 %'),
    commandEntry('Bookmark this view'),
    commandEntry('Bookmarks of views'),
    ...(document.inside.length ? [commandEntry('Leave the subsystem')] : []),
    null,
    commandEntry('Find blocks, types, values and bookmarks'),
    commandEntry('Configuration parameters'),
    {
      title: 'Export the sheet',
      submenu: ['SVG', 'PNG', 'PDF'].map((kind) => ({
        ...commandEntry(`Export the sheet as ${kind}`),
        title: kind,
      })),
    },
  ]
}

function blockEntries(document: OpenDocument, block: SheetBlock): Entries {
  const path = [...document.inside, block.name]
  const several = selectedBlocks().length > 1
  const chart = hasChart(path.join('/'))
  const opens: Entries = [
    ...(chart ? [{ title: 'Show its chart', run: () => showScope(path.join('/')) }] : []),
    ...(block.opens ? [{ title: 'Open the sheet inside', run: () => openSheet(path) }] : []),
    { title: 'Parameters …', run: () => useStudio.getState().edit(block.name) },
    ...(block.opens ? [commandEntry('Edit the mask: parameters of the subsystem or the model')] : []),
    commandEntry('Rename'),
    null,
  ]
  return [
    ...(several ? [] : opens),
    commandEntry('Cut'),
    commandEntry('Copy'),
    commandEntry('Duplicate'),
    { title: 'Delete', keys: 'Del', run: () => removeSelected(new Set()) },
    commandEntry('Delete and connect the neighbours'),
    null,
    commandEntry('Rotate'),
    commandEntry('Flip'),
    ...(several ? [{ title: 'Align', submenu: ALIGNMENTS.map(commandEntry) }] : []),
    { title: several ? 'Names' : 'Name', submenu: nameEntries(selectedBlocks()) },
    { title: 'Colour', submenu: colourEntries(selectedBlocks()) },
    commandEntry('Group into a subsystem'),
    commandEntry('Comment out, or uncomment'),
    commandEntry('Comment through, or uncomment'),
  ]
}

/** The sides without ports, and the present side of the name. */
function nameEntries(chosen: SheetBlock[]): Entries {
  const titles = {
    auto: 'At a side without wires',
    below: 'Below',
    above: 'Above',
    left: 'Left',
    right: 'Right',
    hidden: 'Hidden',
  }
  const present = (side: string) => chosen.every(({ place }) => (place.name_side ?? 'auto') === side)
  return (Object.keys(titles) as (keyof typeof titles)[])
    .filter((side) => present(side) || chosen.every((block) => !portSides(block).has(side)))
    .map((side) => ({ title: titles[side], checked: present(side), run: () => setNameSide(side) }))
}

const COLOURS = ['none', 'red', 'orange', 'yellow', 'green', 'cyan', 'blue', 'purple', 'grey'] as const

function colourEntries(chosen: SheetBlock[]): Entries {
  return COLOURS.map((colour) => ({
    title: `${colour[0]!.toUpperCase()}${colour.slice(1)}`,
    swatch: colour === 'none' ? 'var(--surface)' : `var(--tint-${colour})`,
    checked: chosen.every(({ place }) => (place.colour ?? 'none') === colour),
    run: () => setColour(colour),
  }))
}

const ALIGNMENTS = [
  'Align left edges',
  'Align centres',
  'Align right edges',
  'Align top edges',
  'Align middles',
  'Align bottom edges',
  'Equal gaps from left to right',
  'Equal gaps from top to bottom',
]

function noteEntries(note: string): Entries {
  return [
    { title: 'Edit the note', keys: 'Enter', run: () => editNote(note) },
    null,
    commandEntry('Cut'),
    commandEntry('Copy'),
    commandEntry('Duplicate'),
    { title: 'Delete', keys: 'Del', run: () => removeSelected(new Set()) },
  ]
}

/** Logging and the pinned value of an output. */
function signalEntries(document: OpenDocument, port: string): Entries {
  const path = [...document.inside, port].join('/')
  const logged = document.logged.includes(port)
  return [
    { title: 'Name the signal …', run: () => nameSignal(port) },
    {
      title: 'Log the signal',
      checked: logged,
      run: () => void change({ kind: 'log', port, logged: !logged }),
    },
    {
      title: 'Show its value on the sheet',
      checked: useShownValues.getState().pinned.has(path),
      run: () =>
        useShownValues.setState((s) => {
          const pinned = new Set(s.pinned)
          if (!pinned.delete(path)) pinned.add(path)
          return { pinned }
        }),
    },
  ]
}

function wireEntries(document: OpenDocument, wire: Wire, point: Point): Entries {
  const end = { port: wire.source, isOutput: true }
  return [
    { title: 'Branch to a new block …', run: () => showDialog('insert', '', point, end) },
    ...(isFrame(document.blocks, wire.source) ? [] : signalEntries(document, wire.source)),
    null,
    {
      title: 'Reset the route',
      enabled: Boolean(wire.bends?.length), // never of a frame line
      run: () => void change({ kind: 'bend', wires: [{ source: wire.source, target: wire.target }] }),
    },
    {
      title: 'Delete',
      keys: 'Del',
      run: () => void change({ kind: 'remove', wires: [wire] }),
    },
  ]
}

function portEntries(document: OpenDocument, port: string, isOutput: boolean, point: Point): Entries {
  const frame = isFrame(document.blocks, port)
  const wires = document.wires.filter(({ source, target }) =>
    frame ? source === port || target === port : (isOutput ? source : target) === port,
  )
  const enabled = isOutput || frame || !wires.length
  const byName = frame ? 'a frame port' : isOutput ? 'an input' : 'an output'
  const connect: Entries = [
    {
      title: 'Connect to a new block …',
      enabled,
      run: () =>
        showDialog(
          'insert',
          '',
          { x: point.x + (isOutput ? NEW_BLOCK_DISTANCE : -NEW_BLOCK_DISTANCE), y: point.y },
          { port, isOutput },
        ),
    },
    {
      title: `Connect to ${byName} by name …`,
      keys: '>',
      enabled,
      run: () => showDialog('connect', '', null, { port, isOutput }),
    },
    {
      title: wires.length > 1 ? 'Delete its wires' : 'Delete its wire',
      enabled: wires.length > 0,
      run: () => void change({ kind: 'remove', wires }),
    },
  ]
  const driven = isOutput ? port : wires[0]?.source
  return !frame &&
    driven &&
    document.blocks[blockOf(driven)]?.outputs.some(({ name }) => name === portOf(driven))
    ? [...connect, null, ...signalEntries(document, driven)]
    : connect
}

/** Distance of a new block from the port to which it is connected, screen px. */
const NEW_BLOCK_DISTANCE = 60
