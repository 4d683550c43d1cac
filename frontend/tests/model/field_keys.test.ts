import { expect, test } from 'vitest'
import { isCommandKey } from '../../src/model/field_keys'

const pressed = (key: string, ctrlKey = true, altKey = false) => ({ key, ctrlKey, metaKey: false, altKey })

test('keys with Ctrl that edit text belong to the field, others are commands', () => {
  expect(
    ['a', 'C', 'v', 'z', 'ArrowLeft', 'Backspace', 'Control'].some((key) => isCommandKey(pressed(key))),
  ).toBe(false)
  expect(['s', 'S', 'Enter', 'e', '.'].every((key) => isCommandKey(pressed(key)))).toBe(true)
  expect(isCommandKey(pressed('s', false))).toBe(false)
  expect(isCommandKey(pressed('q', true, true))).toBe(false) // AltGr types a character
})
