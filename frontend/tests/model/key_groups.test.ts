import { describe, expect, it } from 'vitest'
import { KEYS } from '../../src/key_list'
import { keyGroups } from '../../src/model/key_groups'

describe('the key map', () => {
  const groups = keyGroups(
    [
      { title: 'Save', keys: 'Ctrl+S' },
      { title: 'Rotate', keys: 'Ctrl+R', sheetOnly: true },
      { title: 'Light theme' },
    ],
    KEYS,
  )
  it('has the commands with keys, apart from those of the sheet', () => {
    expect(groups[0]).toEqual({ title: 'Commands', keys: [['Ctrl+S', 'Save']] })
    expect(groups[1]).toEqual({ title: 'Commands of the sheet', keys: [['Ctrl+R', 'Rotate']] })
  })
  it('has all other keys in the order of the key list', () => {
    expect(groups.slice(2)).toEqual(KEYS)
    expect(groups.every(({ keys }) => keys.length > 0)).toBe(true)
  })
  it('has each combination of a group once', () => {
    for (const { keys } of groups)
      expect(new Set(keys.map(([combination]) => combination)).size).toBe(keys.length)
  })
})
