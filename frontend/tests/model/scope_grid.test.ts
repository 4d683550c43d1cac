import { expect, test } from 'vitest'
import { scopeGrid } from '../../src/model/scope_grid'

test('scopes fill their panel, and are as large as possible', () => {
  expect(scopeGrid(1, 900, 300)).toEqual({ columns: 1, rowHeight: 300 })
  expect(scopeGrid(2, 900, 300)).toEqual({ columns: 2, rowHeight: 300 })
  expect(scopeGrid(2, 500, 900)).toEqual({ columns: 1, rowHeight: 450 })
  expect(scopeGrid(4, 1600, 800)).toEqual({ columns: 2, rowHeight: 400 })
  expect(scopeGrid(7, 2000, 420)).toEqual({ columns: 4, rowHeight: 210 })
})

test.each([1, 2, 3, 4, 5, 7, 9, 16, 31])('%i scopes are wide and high enough in every panel', (count) => {
  for (const width of [200, 460, 700, 1300, 2300])
    for (const height of [120, 215, 400, 900]) {
      const { columns, rowHeight } = scopeGrid(count, width, height)
      expect(columns === 1 || width / columns >= 220).toBe(true)
      expect(rowHeight).toBeGreaterThanOrEqual(Math.min(150, height) - 26)
      const rows = Math.ceil(count / columns)
      expect(rows * rowHeight, 'no room is left below').toBeGreaterThanOrEqual(height - 1e-9)
    }
})
