import { commands } from '../commands'
import { openMenu, type Entries, type Entry } from '../context_menu_state'
import { show } from '../dialogs'
import { showScope } from '../dock'
import { blockOf, portOf, wireKey } from '../model/wires'
import type { SheetBlock, Wire } from '../protocol'
import { useValues } from '../run/wire_values'
import { change, look, useStudio, type OpenDocument } from '../store'
import { chosenBlocks, setColour, setNameSide } from './arranging'
import { pasteAt } from './clipboard'
import { placeAt } from './insert'
import { editNote, writeNote } from './note_node'
import { nodeAt, wireAtElement } from './right_button'
import { chartOf } from './sheet_actions'
import { removeChosen } from './sheet_keys'
import { portSides } from './sheet_layout'
import { nameSignal } from './signal_names'

type Point = { x: number; y: number }

/** Open the context menu of an element of the sheet: a port, block, note, line, or the sheet itself. */
export function openSheetMenu(at: Point, element: Element, selectWire: (key: string) => void): void {
  const { document, selection, select } = useStudio.getState()
  if (!document) return
  const handle = element.closest('.react-flow__handle')
  const node = nodeAt(element)
  const wire = document.wires.find((one) => wireKey(one) === wireAtElement(element))
  if (node && handle) {
    const port = `${node}/${handle.getAttribute('data-handleid')}`
    openMenu(port, at, portEntries(document, port, handle.classList.contains('source'), at))
  } else if (node) {
    if (!selection.has(node)) select([node])
    const block = document.blocks[node]
    openMenu(block?.name ?? 'Note', at, block ? blockEntries(document, block) : noteEntries(node))
  } else if (wire) {
    selectWire(wireKey(wire))
    openMenu(`Line from ${wire.source}`, at, lineEntries(document, wire, at))
  } else openMenu('Sheet', at, sheetEntries(document, at))
}

/** A command as an entry. */
function command(title: string): Entry {
  const found = commands().find((one) => one.title === title)
  if (!found) throw new Error(`There is no command "${title}".`)
  return { title, keys: found.keys, possible: found.possible?.() ?? true, run: found.run }
}

function sheetEntries(document: OpenDocument, at: Point): Entries {
  return [
    { title: 'Add a block here …', run: () => show('insert', '', at) },
    { title: 'Write a note here', run: () => writeNote(placeAt(at).x, placeAt(at).y) },
    { title: 'Paste here', run: () => void pasteAt(placeAt(at)) },
    command('Select all'),
    null,
    command('Undo'),
    command('Redo'),
    null,
    command('Arrange the sheet'),
    command('Ground and terminate unconnected ports'),
    command('Fit the sheet into the window'),
    command('Show the sheet at 100 %'),
    ...(document.inside.length ? [command('Leave the subsystem')] : []),
    null,
    command('Find blocks, types and values'),
    command('Configuration parameters'),
    {
      title: 'Export the sheet',
      within: ['SVG', 'PNG', 'PDF'].map((kind) => ({
        ...command(`Export the sheet as ${kind}`),
        title: kind,
      })),
    },
  ]
}

function blockEntries(document: OpenDocument, block: SheetBlock): Entries {
  const path = [...document.inside, block.name]
  const several = chosenBlocks().length > 1
  const chart = chartOf(path.join('/'))
  const opens: Entries = [
    ...(chart ? [{ title: 'Show its chart', run: () => showScope(path.join('/')) }] : []),
    ...(block.opens ? [{ title: 'Open the sheet inside', run: () => look(path) }] : []),
    { title: 'Parameters …', run: () => useStudio.getState().edit(block.name) },
    ...(block.opens ? [command('Edit the mask: parameters of the subsystem or the model')] : []),
    command('Rename'),
    null,
  ]
  return [
    ...(several ? [] : opens),
    command('Cut'),
    command('Copy'),
    command('Duplicate'),
    { title: 'Delete', keys: 'Del', run: () => removeChosen(new Set()) },
    null,
    command('Rotate'),
    command('Flip'),
    ...(several ? [{ title: 'Align', within: ALIGNMENTS.map(command) }] : []),
    { title: several ? 'Names' : 'Name', within: nameEntries(chosenBlocks()) },
    { title: 'Colour', within: colourEntries(chosenBlocks()) },
    command('Group into a subsystem'),
    command('Comment out, or uncomment'),
    command('Comment through, or uncomment'),
  ]
}

/** The sides without ports, and the present one. */
function nameEntries(chosen: SheetBlock[]): Entries {
  const titles = {
    auto: 'At a side without lines',
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
    command('Cut'),
    command('Copy'),
    command('Duplicate'),
    { title: 'Delete', keys: 'Del', run: () => removeChosen(new Set()) },
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
      checked: useValues.getState().pinned.has(path),
      run: () =>
        useValues.setState((s) => {
          const pinned = new Set(s.pinned)
          if (!pinned.delete(path)) pinned.add(path)
          return { pinned }
        }),
    },
  ]
}

function lineEntries(document: OpenDocument, wire: Wire, at: Point): Entries {
  const end = { port: wire.source, isOutput: true }
  return [
    { title: 'Branch to a new block …', run: () => show('insert', '', at, end) },
    ...signalEntries(document, wire.source),
    null,
    {
      title: 'Reset the route',
      possible: Boolean(wire.bends?.length),
      run: () => void change({ kind: 'bend', wires: [{ source: wire.source, target: wire.target }] }),
    },
    {
      title: 'Delete',
      keys: 'Del',
      run: () => void change({ kind: 'remove', wires: [wire] }),
    },
  ]
}

function portEntries(document: OpenDocument, port: string, isOutput: boolean, at: Point): Entries {
  const wires = document.wires.filter((wire) => (isOutput ? wire.source : wire.target) === port)
  const connect: Entries = [
    {
      title: 'Connect to a new block …',
      possible: isOutput || !wires.length,
      run: () => show('insert', '', { x: at.x + (isOutput ? AWAY : -AWAY), y: at.y }, { port, isOutput }),
    },
    {
      title: isOutput ? 'Connect to an input by name …' : 'Connect to an output by name …',
      keys: '>',
      possible: isOutput || !wires.length,
      run: () => show('connect', '', null, { port, isOutput }),
    },
    {
      title: wires.length > 1 ? 'Delete its lines' : 'Delete its line',
      possible: wires.length > 0,
      run: () => void change({ kind: 'remove', wires }),
    },
  ]
  const driven = isOutput ? port : wires[0]?.source
  return driven && document.blocks[blockOf(driven)]?.outputs.some(({ name }) => name === portOf(driven))
    ? [...connect, null, ...signalEntries(document, driven)]
    : connect
}

/** Distance of a new block from the port to which it is connected, screen px. */
const AWAY = 60
