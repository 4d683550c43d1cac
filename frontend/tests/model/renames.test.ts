import { expect, test } from 'vitest'
import { freeShift } from '../../src/model/free_place'
import { pathAfter, pathsAfter, textAfter, withKeysAfter } from '../../src/model/renames'
import { RunSamples } from '../../src/model/run_samples'
import type { Channel } from '../../src/protocol'

const channel = (name: string): Channel => ({ name, shape: [], unit: '', entries: [] })

test('blocks, ports, parameters and inner blocks follow a rename; similar paths do not', () => {
  const renamed = { 'plant/arm': 'plant/robot' }
  expect(
    ['plant/arm', 'plant/arm/y', 'plant/arm.gain', 'plant/arm/inner/y', 'plant/arm 2/y', 'arm/y'].map(
      (path) => pathAfter(path, renamed),
    ),
  ).toEqual([
    'plant/robot',
    'plant/robot/y',
    'plant/robot.gain',
    'plant/robot/inner/y',
    'plant/arm 2/y',
    'arm/y',
  ])
  expect(withKeysAfter({ 'plant/arm.gain': 2, 'b.gain': 3 }, renamed)).toEqual({
    'plant/robot.gain': 2,
    'b.gain': 3,
  })
  expect(pathsAfter(['plant/arm/y', 'b/y'], renamed)).toEqual(new Set(['plant/robot/y', 'b/y']))
})

test('quoted paths in messages follow a rename', () => {
  const renamed = { 'plant/arm': 'plant/robot', u: 'v' }
  expect(
    textAfter("block 'plant/arm' (Gain): input 'plant/arm/u' of 'arm' isn't finite at 2 s", renamed),
  ).toBe("block 'plant/robot' (Gain): input 'plant/robot/u' of 'arm' isn't finite at 2 s")
})

test('samples are found by the new name and alias, and later frames have the same columns', () => {
  const samples = new RunSamples('r', [channel('a/y'), channel('b/y')], { a: 'a/y', 's/u': 'a/y' })
  samples.rename({ a: 'c' })
  expect(samples.names).toEqual(['c/y', 'b/y'])
  expect(samples.signal('a/y')).toBeUndefined()
  expect(samples.signal('c')?.channel.name).toBe('c/y')
  expect(samples.signal('s/u')?.channel.name).toBe('c/y')
  expect(samples.title('c/y')).toBe('c')
  samples.name([channel('a/y'), channel('b/y')], { a: 'a/y' })
  expect(samples.names).toEqual(['a/y', 'b/y'])
})

test('a copy never lies exactly on another block', () => {
  const places = [
    { x: 30, y: 30 },
    { x: 60, y: 60 },
  ]
  expect(freeShift([{ x: 0, y: 0 }], places, 30)).toBe(90)
  expect(freeShift([{ x: 0, y: 5 }, {}], places, 30)).toBe(30)
})
