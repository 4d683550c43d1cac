import { createTheme } from '@mantine/core'

/** Colours, type and corners of the component library, as everywhere in armblocks. */
export const theme = createTheme({
  fontFamily: 'var(--font)',
  fontFamilyMonospace: 'var(--mono)',
  colors: {
    accent: ['#fff1e6', '#ffe0c7', '#ffc08f', '#ff9a4d', '#f07d24', '#d9650d', '#c25603', '#b04a00', '#8f3c00', '#702f00'],
  },
  respectReducedMotion: true,
  primaryColor: 'accent',
  primaryShade: { light: 7, dark: 3 },
  autoContrast: true,
  defaultRadius: 'sm',
  // The page never scrolls; to forbid it anyway would style the whole of it anew for each dialog.
  // The colours of titles and labels on their own tint are too pale to read.
  components: { Modal: { defaultProps: { lockScroll: false } }, Alert: { styles: { title: { color: 'var(--ink)' } } } },
  fontSizes: { xs: '11px', sm: '12px', md: '13px', lg: '15px', xl: '18px' },
})
