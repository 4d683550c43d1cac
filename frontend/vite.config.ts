import react from '@vitejs/plugin-react'
import subsetFont from 'subset-font'
import { defineConfig, type Plugin, type UserConfig } from 'vite'

import { bundledPackages } from './bundled_packages'

/** Themes of the dock layout that the page does not offer: they are most of its styles. */
const OTHER_THEME = /\.dockview-theme-(?!(light|dark)(?![\w-]))/
/** A font for browsers that are too old for the page anyway. */
const OLD_FONT = /,\s*url\([^)]*\.woff\)\s*format\('woff'\)/

/** Takes styles away that nobody sees. */
const unseen: Exclude<NonNullable<NonNullable<UserConfig['css']>['postcss']>, string>['plugins'] = [
  {
    postcssPlugin: 'unseen',
    Rule(rule) {
      const kept = rule.selectors.filter((selector) => !OTHER_THEME.test(selector))
      if (!kept.length) rule.remove()
      else if (kept.length < rule.selectors.length) rule.selectors = kept
    },
    Declaration: {
      src: (declaration) => {
        declaration.value = declaration.value.replace(OLD_FONT, '')
      },
    },
  },
]

/** What the style sheet of the font says that this part of it has: `unicode-range` of the Latin part. */
const LATIN =
  'U+20-7E,U+A0-FF,U+131,U+152-153,U+2BB-2BC,U+2C6,U+2DA,U+2DC,U+304,U+308,U+329,U+2000-206F,' +
  'U+20AC,U+2122,U+2191,U+2193,U+2212,U+2215,U+FEFF,U+FFFD'

function characters(ranges: string): string {
  return ranges
    .split(',')
    .map((range) => {
      const [from, to = from] = range
        .slice(2)
        .split('-')
        .map((code) => parseInt(code, 16)) as [number, number?]
      return String.fromCodePoint(...Array.from({ length: to - from + 1 }, (_, k) => from + k))
    })
    .join('')
}

/**
 * The part of the sans that every page needs, without the weights and the alternates that none shows: half
 * the size.
 */
function lighterSans(): Plugin {
  return {
    name: 'lighter-sans',
    apply: 'build',
    async generateBundle(_, bundle) {
      for (const part of Object.values(bundle))
        if (part.type === 'asset' && /inter-latin-wght-normal/.test(part.fileName))
          part.source = await subsetFont(Buffer.from(part.source), characters(LATIN), {
            targetFormat: 'woff2',
            variationAxes: { wght: { min: 400, max: 700 } },
          })
    },
  }
}

export default defineConfig({
  base: './',
  plugins: [react(), lighterSans(), bundledPackages()],
  css: { postcss: { plugins: unseen } },
  build: {
    outDir: process.env['ARMBLOCKS_OUT'] ?? '../src/armblocks/studio/web',
    emptyOutDir: true,
    assetsInlineLimit: 0, // the page's security policy allows no fonts and pictures but the server's own
    chunkSizeWarningLimit: 1200,
  },
})
