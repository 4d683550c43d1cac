import { expect, test } from 'vitest'
import {
  isInsertable,
  alignedPosition,
  insertIntoWire,
  wireDifference,
  disconnectBlocks,
  insertionAt,
  wireAt,
} from '../../src/model/rewiring'
import { connectionsTo, reconnections } from '../../src/model/connections'
import { freePort } from '../../src/model/free_port'
import { sameKind, wireKey } from '../../src/model/wires'
import type { SheetPort, SheetBlock, Wire } from '../../src/protocol'

const port = (name: string, x: number, y: number): SheetPort => ({
  name,
  x,
  y,
  dx: 1,
  dy: 0,
  doc: '',
  label: '',
  unit: '',
})

function block(name: string, inputs = ['u'], outputs = ['y']): SheetBlock {
  return {
    name,
    type: 'Gain',
    title: name,
    place: { x: 0, y: 0 },
    width: 60,
    height: 40,
    face: '',
    inputs: inputs.map((input, k) => port(input, 0, 20 + 10 * k)),
    outputs: outputs.map((output, k) => port(output, 60, 20 + 10 * k)),
    opens: false,
    shown_name_side: 'below',
    parameters: {},
    formulas: {},
    mask: [],
    link: '',
  }
}

const wire = (source: string, target: string): Wire => ({ source, target })
const signal = (source: string, target: string) => ({ wire: wire(source, target), frame: false })
const sorted = (wires: Wire[]) => wires.map(wireKey).sort()

const gain = block('gain')
const chain = [
  wire('step/y', 'gain/u'),
  wire('gain/y', 'plant/u'),
  wire('gain/y', 'scope/in1'),
  wire('clock/y', 'log/in1'),
]

test('disconnecting a block connects its neighbours, and inserting it again restores the wires', () => {
  const afterDisconnecting = disconnectBlocks([gain], chain)
  expect(sorted(afterDisconnecting)).toEqual(
    sorted([wire('step/y', 'plant/u'), wire('step/y', 'scope/in1'), wire('clock/y', 'log/in1')]),
  )
  const single = [wire('step/y', 'gain/u'), wire('gain/y', 'plant/u')]
  expect(sorted(insertIntoWire(gain, signal('step/y', 'plant/u'), disconnectBlocks([gain], single)))).toEqual(
    sorted(single),
  )
})

test('several blocks keep the wires between them and lose all others', () => {
  expect(disconnectBlocks([gain, block('plant')], chain)).toEqual([
    wire('gain/y', 'plant/u'),
    wire('clock/y', 'log/in1'),
  ])
})

test('disconnecting a block with two inputs connects no neighbours; insertion uses its first ports', () => {
  const sum = block('sum', ['in1', 'in2'])
  expect(
    disconnectBlocks([sum], [wire('a/y', 'sum/in1'), wire('b/y', 'sum/in2'), wire('sum/y', 'c/u')]),
  ).toEqual([])
  expect(insertIntoWire(sum, signal('a/y', 'c/u'), [wire('a/y', 'c/u')])).toEqual([
    wire('a/y', 'sum/in1'),
    wire('sum/y', 'c/u'),
  ])
})

test('frame ports are connected with frame ports only, also in an insertion into a line', () => {
  const frames = (name: string, ...ports: string[]): SheetBlock => {
    const ends = ports.map((end) => ({ ...port(end, 0, 20), frame: true }))
    const shown = block(name)
    return { ...shown, inputs: [...ends, ...shown.inputs], outputs: [...ends, ...shown.outputs] }
  }
  const [joint, solid] = [frames('joint', 'B', 'F'), frames('solid', 'R')]
  const blocks = { joint, solid, gain }
  expect(sameKind(blocks, 'joint/F', 'solid/R')).toBe(true)
  expect(sameKind(blocks, 'joint/F', 'joint/u')).toBe(false)
  expect(sameKind(blocks, 'gain/y', 'joint/u')).toBe(true)
  const line = { wire: wire('world/W', 'rod/B'), frame: true }
  expect(insertIntoWire(joint, line, [line.wire])).toEqual([
    wire('world/W', 'joint/B'),
    wire('joint/F', 'rod/B'),
  ])
  expect(insertIntoWire(solid, line, [])).toEqual([wire('world/W', 'solid/R'), wire('solid/R', 'rod/B')])
  expect(insertIntoWire(joint, signal('a/y', 'c/u'), [])).toEqual([
    wire('a/y', 'joint/u'),
    wire('joint/y', 'c/u'),
  ])
  expect(freePort(joint, true, [wire('world/W', 'joint/B')], true)).toBe('joint/F')
  expect(freePort(joint, true, [], false)).toBe('joint/u')
  const path: [number, number][] = [
    [0, 50],
    [100, 50],
  ]
  const edge = {
    id: wireKey(line.wire),
    source: 'world',
    sourceHandle: 'W',
    target: 'rod',
    targetHandle: 'B',
    data: { path, frame: true },
  }
  expect(insertionAt(joint, { x: 50, y: 50 }, [edge], [line.wire])?.frame).toBe(true)
  expect(insertionAt(gain, { x: 50, y: 50 }, [edge], [line.wire]), 'no frame ports').toBeUndefined()
})

test('an edit contains exactly the added and removed wires', () => {
  const after = disconnectBlocks([gain], chain)
  const { wires, instead } = wireDifference(chain, after)
  const removed = new Set(instead.map(wireKey))
  expect(sorted([...chain.filter((old) => !removed.has(wireKey(old))), ...wires])).toEqual(sorted(after))
  expect(wires.concat(instead).map(wireKey)).not.toContain(wireKey(wire('clock/y', 'log/in1')))
})

test('only an unconnected block with an input and an output can be inserted by dropping', () => {
  expect(isInsertable(gain, chain)).toBe(false)
  expect(isInsertable(block('other'), chain)).toBe(true)
  expect(isInsertable(block('source', []), chain)).toBe(false)
})

test('a dropped block is inserted into the horizontal segment below it and aligned with it', () => {
  const drawn = {
    id: wireKey(wire('step/y', 'plant/u')),
    source: 'step',
    sourceHandle: 'y',
    target: 'plant',
    targetHandle: 'u',
    data: {
      path: [
        [0, 50],
        [100, 50],
        [100, 90],
        [400, 90],
      ] as [number, number][],
    },
  }
  const wires = [wire('step/y', 'plant/u')]
  const segment = wireAt({ x: 200, y: 85 }, [drawn], wires)!
  expect(segment).toMatchObject({ wire: wires[0], y: 90, left: 100, right: 400, flipped: false })
  expect(alignedPosition(gain, { x: 170, y: 65 }, segment)).toEqual({ x: 170, y: 70, flipped: false })
  expect(
    alignedPosition(gain, { x: 170, y: 65 }, { ...segment, right: 200 }),
    'centred on a short segment',
  ).toMatchObject({
    x: 120,
  })
  expect(wireAt({ x: 200, y: 60 }, [drawn], wires), 'too far away').toBeUndefined()
  expect(wireAt({ x: 100, y: 70 }, [drawn], wires), 'a vertical segment').toBeUndefined()
  expect(wireAt({ x: 200, y: 85 }, [drawn], []), 'the preview of a new wire').toBeUndefined()
})

test('removed chains of blocks with one input and output leave their neighbours connected', () => {
  const [gain2, sum] = [block('gain 2'), block('sum', ['in1', 'in2'])]
  const wires = [
    wire('step/y', 'gain/u'),
    wire('gain/y', 'gain 2/u'),
    wire('gain 2/y', 'plant/u'),
    wire('gain/y', 'scope/in1'),
    wire('gain 2/y', 'sum/in1'),
    wire('sum/y', 'log/u'),
  ]
  expect(sorted(reconnections([gain, gain2], wires))).toEqual(
    sorted([wire('step/y', 'plant/u'), wire('step/y', 'scope/in1'), wire('step/y', 'sum/in1')]),
  )
  expect(reconnections([gain2, sum], wires).map(wireKey)).toEqual(['gain/y -> plant/u'])
  const loop = [wire('gain/y', 'gain 2/u'), wire('gain 2/y', 'gain/u'), wire('gain 2/y', 'scope/in1')]
  expect(reconnections([gain, gain2], loop)).toEqual([])
})

test('selected blocks are connected to the free inputs of a block, or at one frame', () => {
  const [pair, sum] = [block('pair', [], ['a', 'b']), block('sum', ['in1', 'in2', 'in3'])]
  const present = [wire('gain/y', 'sum/in1')]
  expect(connectionsTo(sum, [pair], present).map(wireKey)).toEqual(['pair/a -> sum/in2', 'pair/b -> sum/in3'])
  expect(connectionsTo(sum, [pair, block('c'), gain], present).map(wireKey)).toEqual([
    'pair/a -> sum/in2',
    'c/y -> sum/in3',
  ])
  expect(connectionsTo(sum, [gain, sum], present)).toEqual([])
  expect(connectionsTo(body('b'), [gain], []).map(wireKey)).toEqual(['gain/y -> b/u'])
  const line = wire('a/F', 'b/B')
  expect(connectionsTo(body('b'), [body('a')], [])).toEqual([line])
  expect(connectionsTo(body('b'), [body('a')], [line]), 'a common frame').toEqual([])
  expect(connectionsTo(body('c'), [body('a')], [line, wire('a/F', 'd/B')]).map(wireKey)).toEqual([
    'a/B -> c/B',
  ])
  expect(connectionsTo(body('b'), [gain], [wire('x/y', 'b/u')]), 'no signal to a frame').toEqual([])
  expect(connectionsTo(gain, [body('a')], [])).toEqual([])
})

/** A block with the frame ports B at its left and F at its right, and a signal input. */
function body(name: string, signals = ['u']): SheetBlock {
  const frame = (end: string, x: number) => ({ ...port(end, x, 20), dx: x ? 1 : -1, frame: true })
  const frames = [frame('B', 0), frame('F', 60)]
  const inputs = signals.map((input) => port(input, 30, 0))
  return { ...block(name), inputs: [...frames, ...inputs], outputs: frames }
}

test('the frames at both ports of removed joints become one frame', () => {
  const chainOfBodies = [
    wire('world/W', 'a/B'),
    wire('a/F', 'b/B'),
    wire('a/F', 'side/R'),
    wire('b/F', 'c/B'),
    wire('x/y', 'a/u'),
  ]
  const after = (...names: string[]) =>
    sorted(
      reconnections(
        names.map((name) => body(name)),
        chainOfBodies,
      ),
    )
  expect(after('a')).toEqual(['world/W -> b/B'])
  expect(after('a', 'b')).toEqual(['world/W -> c/B', 'world/W -> side/R'])
  expect(after('b')).toEqual(['a/F -> c/B'])
  expect(
    reconnections(
      [{ ...body('a'), outputs: [...body('a').outputs, port('q', 60, 30)] }],
      [wire('x/y', 'a/u'), wire('a/q', 'scope/in1')],
    ),
    'a joint passes no signal',
  ).toEqual([])
})
