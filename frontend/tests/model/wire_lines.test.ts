import { describe, expect, test } from 'vitest'
import { dragged, completeRoute } from '../../src/model/bends'
import {
  stretchedToPorts,
  endsAtPorts,
  svgPath,
  type Point,
  type PortPosition,
} from '../../src/model/wire_lines'

const output: PortPosition = { x: 60, y: 20, dx: 1, dy: 0 }
const input: PortPosition = { x: 300, y: 120, dx: -1, dy: 0 }
const steppedPath: Point[] = [
  [60, 20],
  [150, 20],
  [150, 120],
  [300, 120],
]

describe('a line that the server has routed', () => {
  test('fits the ports at its ends, and is stretched to moved ports until it is routed again', () => {
    expect(endsAtPorts(steppedPath, false, [output, input])).toBe(true)
    const moved = { ...input, x: 320, y: 90 }
    expect(endsAtPorts(steppedPath, false, [output, moved])).toBe(false)
    expect(stretchedToPorts(steppedPath, false, [output, moved])).toEqual([
      [60, 20],
      [150, 20],
      [150, 90],
      [320, 90],
    ])
    const lower = { ...output, y: 40 }
    expect(stretchedToPorts(steppedPath, false, [lower, input])[1]).toEqual([150, 40])
  })

  test.each([0, 30])('that is straight gets a step if a port has moved by %i px', (by) => {
    const straight: Point[] = [
      [60, 20],
      [300, 20],
    ]
    const ends: [PortPosition, PortPosition] = [output, { ...input, y: 20 + by }]
    const path = stretchedToPorts(straight, false, ends)
    expect(endsAtPorts(path, false, ends)).toBe(true)
    for (const [k, [x, y]] of path.slice(1).entries())
      expect(x === path[k]![0] || y === path[k]![1], 'each segment is horizontal or vertical').toBe(true)
    expect(stretchedToPorts([], false, ends)).toEqual([path[0], path.at(-1)])
  })

  test('has round corners, and sharp corners at branches', () => {
    expect(svgPath(steppedPath)).toContain('Q150 20')
    expect(svgPath(steppedPath, [[150, 20]])).toContain('L150 20L')
  })

  test('that branches has its complete route from the output', () => {
    const net = {
      paths: {
        'b/u': steppedPath as [number, number][],
        'c/u': [
          [150, 60],
          [200, 60],
        ] as [number, number][],
      },
      dots: [[150, 60]] as [number, number][],
      label: 'a',
    }
    expect(completeRoute(net, 'b/u')).toEqual(steppedPath)
    expect(completeRoute(net, 'c/u')).toEqual([
      [60, 20],
      [150, 20],
      [150, 60],
      [200, 60],
    ])
  })
})

test('a dragged segment becomes a bend; a segment at a port keeps a short part at the port', () => {
  expect(dragged(steppedPath, 1, 220)).toEqual([220])
  expect(dragged(steppedPath, 0, 60)).toEqual([75, 60, 150])
  const stepped: Point[] = [
    [60, 20],
    [75, 20],
    [75, 60],
    [150, 60],
    [150, 120],
    [300, 120],
  ]
  expect(dragged(stepped, 2, 20), 'after dragging back, the step has no height').toEqual([75, 20, 150])
})
