import react from '@vitejs/plugin-react'
import subsetFont from 'subset-font'
import { defineConfig, type Plugin, type UserConfig } from 'vite'

import { bundledPackages } from './bundled_packages'

/** Unused themes of the dock layout, which are most of its styles. */
const OTHER_THEME = /\.dockview-theme-(?!(light|dark)(?![\w-]))/
/** A font format for browsers that the studio does not support. */
const OLD_FONT = /,\s*url\([^)]*\.woff\)\s*format\('woff'\)/

/** Removes unused styles. */
const unusedStyles: Exclude<NonNullable<NonNullable<UserConfig['css']>['postcss']>, string>['plugins'] = [
  {
    postcssPlugin: 'unused-styles',
    Rule(rule) {
      const used = rule.selectors.filter((selector) => !OTHER_THEME.test(selector))
      if (!used.length) rule.remove()
      else if (used.length < rule.selectors.length) rule.selectors = used
    },
    Declaration: {
      src: (declaration) => {
        declaration.value = declaration.value.replace(OLD_FONT, '')
      },
    },
  },
]

/** The `unicode-range` of the Latin part, from the style sheet of the font. */
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
 * The Latin part of the sans-serif font without unused weights and alternates: half the size.
 */
function reducedSansFont(): Plugin {
  return {
    name: 'reduced-sans-font',
    apply: 'build',
    async generateBundle(_, bundle) {
      for (const asset of Object.values(bundle))
        if (asset.type === 'asset' && /inter-latin-wght-normal/.test(asset.fileName))
          asset.source = await subsetFont(Buffer.from(asset.source), characters(LATIN), {
            targetFormat: 'woff2',
            variationAxes: { wght: { min: 400, max: 700 } },
          })
    },
  }
}

export default defineConfig({
  base: './',
  plugins: [react(), reducedSansFont(), bundledPackages()],
  css: { postcss: { plugins: unusedStyles } },
  build: {
    outDir: process.env['ARMBLOCKS_OUT'] ?? '../src/armblocks/studio/web',
    emptyOutDir: true,
    assetsInlineLimit: 0, // the security policy of the studio allows only fonts and pictures of the server
    chunkSizeWarningLimit: 1200,
    // Removes the unused components of React Flow.
    rolldownOptions: { treeshake: { manualPureFunctions: ['memo', 'forwardRef'] } },
  },
})
