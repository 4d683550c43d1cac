import { expect, test } from 'vitest'
import { inNaturalOrder } from '../../src/model/natural_order'
import { recoverable } from '../../src/model/recoverable'
import type { Recovery } from '../../src/protocol'

test('numbers in names are sorted by their values', () => {
  const names = ['b1039', 'b39', 'b4', 'B5', 'a', 'Scope 10', 'Scope 9']
  expect(inNaturalOrder(names, (name) => name)).toEqual([
    'a',
    'b4',
    'B5',
    'b39',
    'b1039',
    'Scope 9',
    'Scope 10',
  ])
})

test('an open document is not offered for recovery', () => {
  const recoveries = [{ document: 'a' }, { document: 'b' }] as Recovery[]
  expect(recoverable(recoveries, [{ document: 'b' }])).toEqual([{ document: 'a' }])
})
