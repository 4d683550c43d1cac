import {
  createTheme,
  localStorageColorSchemeManager,
  type AlertProps,
  type MantineColorScheme,
  type MantineTheme,
} from '@mantine/core'
import { create } from 'zustand'

/** The chosen theme, which the browser stores. */
export const themeManager = localStorageColorSchemeManager({ key: 'armblocks-theme' })

const useTheme = create<{ set: (scheme: MantineColorScheme) => void }>(() => ({ set: () => {} }))

/** Select a theme; `auto` is the theme of the system. */
export const setTheme = (scheme: MantineColorScheme): void => useTheme.getState().set(scheme)

/** Register the function of the component library that changes the theme. */
export const onTheme = (set: (scheme: MantineColorScheme) => void): void => useTheme.setState({ set })

/** Colours, fonts and corners of the component library, as in all figures of armblocks. */
export const theme = createTheme({
  fontFamily: 'var(--font)',
  fontFamilyMonospace: 'var(--mono)',
  colors: {
    // The greys of the component library are neutral; these are warmer in the light, bluer in the dark theme.
    gray: [
      '#f6f4f1',
      '#f1eeea',
      '#e9e5e0',
      '#ddd7d0',
      '#cfc9c1',
      '#a39c92',
      '#7d756b',
      '#635d55',
      '#45403a',
      '#23211e',
    ],
    dark: [
      '#e8ebf0',
      '#c9d0da',
      '#a3adba',
      '#7d8794',
      '#3d4652',
      '#2a313b',
      '#222831',
      '#1b2028',
      '#151a20',
      '#12151a',
    ],
    red: [
      '#fbe9e7',
      '#f9d6d2',
      '#f6b7b0',
      '#ff9d8f',
      '#e0675c',
      '#cc453a',
      '#bf3328',
      '#b3261e',
      '#8f1e18',
      '#6d1712',
    ],
    accent: [
      '#fff1e6',
      '#ffe0c7',
      '#ffc08f',
      '#ff9a4d',
      '#f07d24',
      '#d9650d',
      '#c25603',
      '#b04a00',
      '#8f3c00',
      '#702f00',
    ],
  },
  respectReducedMotion: true,
  primaryColor: 'accent',
  primaryShade: { light: 7, dark: 3 },
  autoContrast: true,
  defaultRadius: 'sm',
  components: {
    // Coloured titles have too little contrast on the tinted background. All messages use the same tints.
    Alert: {
      styles: { title: { color: 'var(--ink)' } },
      vars: (_theme: MantineTheme, { color }: AlertProps) => {
        const kind = color === 'red' ? 'error' : color === 'blue' || color === 'gray' ? 'muted' : 'warning'
        return {
          root: {
            '--alert-bg': kind === 'muted' ? 'var(--sunken)' : `var(--${kind}-wash)`,
            '--alert-color': `var(--${kind})`,
          },
        }
      },
    },
    // The focus stop before the first entry is not an entry; the arrow keys do not need it.
    Menu: { defaultProps: { withInitialFocusPlaceholder: false } },
    // The page never scrolls; disabling it would restyle the whole page for each dialog.
    Modal: { defaultProps: { closeButtonProps: { 'aria-label': 'Close' }, lockScroll: false } },
  },
  fontSizes: { xs: '11px', sm: '12px', md: '13px', lg: '15px', xl: '18px' },
})
