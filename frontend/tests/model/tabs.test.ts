import { describe, expect, it } from 'vitest'
import { arePressed } from '../../src/model/key_combinations'
import {
  documentLabels,
  neighbour,
  restorableTabs,
  tabAfter,
  tabLabels,
  updatedTabs,
  withTab,
  type Tab,
} from '../../src/model/tabs'
import type { DocumentState } from '../../src/protocol'

const tab = (document: string, values: Partial<Tab> = {}): Tab => ({
  document,
  kind: 'diagram',
  path: null,
  origin: '',
  title: document,
  ...values,
})
const TABS = ['a', 'b', 'c'].map((document) => tab(document))
const keysOf = (tabs: readonly Tab[]) => tabs.map(({ document }) => document).join('')

describe('the tabs of documents', () => {
  it('are added at the end and keep their order', () => {
    expect(keysOf(withTab(TABS, tab('d')))).toBe('abcd')
    const renamed = withTab(TABS, tab('b', { title: 'B' }))
    expect(keysOf(renamed)).toBe('abc')
    expect(renamed[1]!.title).toBe('B')
  })
  it('get new titles and paths from the states of their documents', () => {
    const state = { ...tab('b', { title: 'B', path: 'B.json' }), version: 3 } as DocumentState
    expect(updatedTabs(TABS, [state])).toEqual([TABS[0], tab('b', { title: 'B', path: 'B.json' }), TABS[2]])
  })
  it.each([
    ['a', 'b'],
    ['b', 'c'],
    ['c', 'b'],
  ])('after %s is closed, %s is shown', (closed, shown) => {
    expect(neighbour(TABS, closed)?.document).toBe(shown)
  })
  it('have no neighbour if there is one only', () => {
    expect(neighbour([tab('a')], 'a')).toBeUndefined()
  })
  it.each([
    ['a', 1, 'b'],
    ['c', 1, 'a'],
    ['a', -1, 'c'],
  ])('from %s, %i steps lead to %s', (from, steps, to) => {
    expect(tabAfter(TABS, from, steps)?.document).toBe(to)
  })
  it('have labels that differ', () => {
    const tabs = [
      tab('1', { title: 'arm', path: 'left/arm.json' }),
      tab('2', { title: 'arm', path: 'right/arm.json' }),
      tab('3', { title: 'arm' }),
      tab('4', { title: 'arm' }),
      tab('5', { title: 'motor', path: 'left/motor.json' }),
    ]
    expect(tabLabels(tabs)).toEqual(['left/arm', 'right/arm', 'arm', 'arm (2)', 'motor'])
  })
  it('give their labels to lists of documents, which number further documents', () => {
    const tabs = [tab('1', { title: 'arm' }), tab('2', { title: 'motor' })]
    const documents = [tab('0', { title: 'arm' }), ...tabs] as DocumentState[]
    expect([...documentLabels(tabs, documents)]).toEqual([
      ['1', 'arm'],
      ['2', 'motor'],
      ['0', 'arm (2)'],
    ])
  })
  it('are restored if the server knows the document, or its file or origin is known', () => {
    const tabs = [
      tab('open'),
      tab('recoverable'),
      tab('file', { path: 'm.json' }),
      tab('copy', { origin: 'kr180model' }),
      tab('discarded'),
    ]
    const restored = restorableTabs(tabs, [{ document: 'open' }], [{ document: 'recoverable' }])
    expect(restored.map(({ document }) => document)).toEqual(['open', 'recoverable', 'file', 'copy'])
  })
})

describe('keys with Alt', () => {
  const pressed = (key: string, modifiers: Partial<KeyboardEvent> = {}) => ({
    key,
    code: '',
    ctrlKey: false,
    metaKey: false,
    altKey: false,
    shiftKey: false,
    ...modifiers,
  })
  it('need exactly the listed modifiers', () => {
    expect(arePressed('Alt+W', pressed('w', { altKey: true }))).toBe(true)
    expect(arePressed('Alt+W', pressed('w'))).toBe(false)
    expect(arePressed('Ctrl+F', pressed('f', { ctrlKey: true }))).toBe(true)
  })
  it('are not triggered by AltGr, which types a character', () => {
    expect(arePressed('Ctrl+E', pressed('e', { ctrlKey: true, altKey: true }))).toBe(false)
    expect(arePressed('Alt+W', pressed('w', { ctrlKey: true, altKey: true }))).toBe(false)
  })
  it('are found on keyboards on which Alt types another letter', () => {
    expect(arePressed('Alt+W', pressed('∑', { altKey: true, code: 'KeyW' }))).toBe(true)
  })
})
