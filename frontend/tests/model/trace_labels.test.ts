import { expect, test } from 'vitest'
import { hasEntry, withEntry, type Trace } from '../../src/model/trace'

const trace: Trace = {
  key: 'arm/q 0',
  channel: 'arm/q',
  element: 0,
  label: 'arm/q link1',
  stem: 'arm/q',
  entry: 'link1',
  unit: 'rad',
  tone: 'trace-0',
  dash: [],
  read: () => undefined,
}

test('the run is a part of the entry, which is never cut off', () => {
  const ofRun = { ...trace, ...withEntry(trace, [trace.entry, 'Run 2']) }
  expect(ofRun.label).toBe('arm/q link1, Run 2')
  expect(hasEntry(ofRun)).toBe(true)
  const scalar = { ...trace, label: 'lag', stem: 'lag', entry: '' }
  expect(hasEntry(scalar)).toBe(false)
  expect(withEntry(scalar, ['', 'Run 2'])).toEqual({ entry: 'Run 2', label: 'lag Run 2' })
})
