import {
  CheckIcon,
  type ComboboxLikeRenderOptionInput,
  type ComboboxItem,
  useComboboxContext,
} from '@mantine/core'
import { useEffect } from 'react'

/**
 * Scrolling of drop-down lists by the browser. Mantine's scroll area requests animation frames without end
 * if it is closed within 100 ms after scrolling, as in lists that scroll to the selected entry.
 */
export const SCROLLED = {
  withScrollArea: false,
  styles: { dropdown: { maxHeight: 220, overflowY: 'auto' } },
} as const

/**
 * An option of a list. If no option is highlighted when this option appears, the selected option is
 * highlighted, or the first option if none is selected.
 */
function Option({ option, checked }: ComboboxLikeRenderOptionInput<ComboboxItem>) {
  const { store } = useComboboxContext()
  useEffect(() => {
    // The list gets its identifier after the effects of its options.
    queueMicrotask(() => {
      if (store.getSelectedOptionIndex() === -1) store.selectActiveOption()
    })
    // Only when the option appears: Mantine highlights the first one after each later key.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [])
  return (
    <>
      {checked && <CheckIcon size={11} opacity={0.4} />}
      <span>{option.label}</span>
    </>
  )
}

/**
 * Properties of a field with a searchable list in which an option is always highlighted, so that Enter
 * selects it. Mantine highlights the first option after a key; if this key opens the list, the options appear
 * later.
 */
export const SEARCHED = {
  ...SCROLLED,
  searchable: true,
  selectFirstOptionOnChange: true,
  renderOption: (input: ComboboxLikeRenderOptionInput<ComboboxItem>) => <Option {...input} />,
} as const
