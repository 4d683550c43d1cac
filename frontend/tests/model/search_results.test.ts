import { describe, expect, it } from 'vitest'
import { groupedResults, MAX_FOUND } from '../../src/model/search_results'

const found = (name: string, inside: string[] = []) => ({ inside, name, title: 'Gain', match: '' })
const searched = (label: string, ...names: string[]) => ({
  document: label,
  label,
  found: names.map((name) => found(name)),
})

describe('results of several documents', () => {
  it('begin with those of the document in front', () => {
    const results = groupedResults([searched('a', 'x', 'y'), searched('b'), searched('c', 'z')], 2)
    expect(results.map(({ document, found: { name } }) => `${document}/${name}`)).toEqual([
      'c/z',
      'a/x',
      'a/y',
    ])
    expect(results.map(({ group }) => group)).toEqual(['c · 1', 'a · 2', 'a · 2'])
  })
  it('have different keys, also for blocks with the same name', () => {
    const both = groupedResults([searched('a', 'x'), searched('b', 'x')], 0)
    expect(new Set(both.map(({ key }) => key)).size).toBe(2)
  })
  it('of one document have no heading', () => {
    expect(groupedResults([searched('a', 'x')], 0)[0]!.group).toBe('')
  })
  it('say that the server has stopped', () => {
    const names = Array.from({ length: MAX_FOUND }, (_, index) => `g${index}`)
    expect(groupedResults([searched('a', ...names), searched('b')], 0)[0]!.group).toBe('a · the first 50')
  })
  it('are in the order of the tabs while a robot is in front', () => {
    expect(
      groupedResults([searched('a', 'x'), searched('b', 'y')], -1).map(({ document }) => document),
    ).toEqual(['a', 'b'])
  })
})
