import { expect, test } from 'vitest'
import {
  bookmarkKey,
  matchingBookmarks,
  orderedBookmarks,
  preferredName,
  roundedPart,
} from '../../src/model/bookmarks'

const part = { x: 0, y: 0, width: 100, height: 50 }
const bookmark = (name: string, ...inside: string[]) => ({ name, inside, part, linked: false })

test('parts are stored in whole pixels, those of hidden sheets not at all', () => {
  const rounded = roundedPart({ x: -0.4, y: 10.6, width: 640.2, height: 359.7 })
  expect(rounded).toEqual({ x: -0, y: 11, width: 640, height: 360 })
  expect(roundedPart({ x: 0, y: 0, width: 0, height: 0 })).toBeNull()
})

test('the name of the selected block is proposed, otherwise that of the sheet', () => {
  expect(preferredName(new Set(['PID']), 'controller')).toBe('PID')
  expect(preferredName(new Set(['PID', 'plant']), 'controller')).toBe('controller')
  expect(preferredName(new Set(), 'controller')).toBe('controller')
})

test('bookmarks are listed sheet by sheet, in the order of their names', () => {
  const bookmarks = ['view 10', 'view 9', 'Motor'].map((name) => bookmark(name, 'drive'))
  const ordered = orderedBookmarks([...bookmarks, bookmark('z')])
  expect(ordered.map(({ name }) => name)).toEqual(['z', 'Motor', 'view 9', 'view 10'])
})

test('a search finds the bookmarks with every typed word', () => {
  const bookmarks = [bookmark('motor winding'), bookmark('motor', 'drive'), bookmark('load')]
  expect(matchingBookmarks(bookmarks, 'MOT win').map(({ name }) => name)).toEqual(['motor winding'])
  expect(matchingBookmarks(bookmarks, '')).toHaveLength(3)
})

test('keys distinguish bookmarks of different sheets', () => {
  const keys = [bookmark('a', 'b'), bookmark('a'), bookmark('b/a')].map(bookmarkKey)
  expect(new Set(keys).size).toBe(3)
})
