import { describe, expect, it } from 'vitest'
import { storedData } from '../src/stored_data'

const stored = (text: string | null) =>
  storedData<unknown>({ getItem: () => text } as unknown as Storage, 'key')

describe('storedData', () => {
  it('returns the stored value', () => {
    expect(stored('{"document":"d1","inside":[]}')).toEqual({ document: 'd1', inside: [] })
  })
  it.each([null, '', '{"document":', 'undefined'])('returns null for %j', (text) => {
    expect(stored(text)).toBeNull()
  })
})
