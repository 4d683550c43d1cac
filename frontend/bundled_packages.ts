import type { Plugin } from 'vite'

/** The folder of the package that a module belongs to, from the last `node_modules` of its path on. */
const PACKAGE = /^.*?\/frontend\/(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//

/**
 * Writes the list of the packages whose code, styles or fonts are in the bundle: `build_page.py` generates
 * the third-party notices from it. Code that tree shaking removes is not listed.
 */
export function bundledPackages(): Plugin {
  return {
    name: 'bundled-packages',
    apply: 'build',
    generateBundle(_, bundle) {
      const modules = [...this.getModuleIds()].filter((id) => /\.css(\?|$)/.test(id))
      for (const chunk of Object.values(bundle)) if (chunk.type === 'chunk') modules.push(...chunk.moduleIds)
      const folders = new Set<string>()
      for (const id of modules) {
        const match = PACKAGE.exec(id.replaceAll('\\', '/').replace('\0', ''))
        if (match?.[1]) folders.add(match[1])
      }
      this.emitFile({
        type: 'asset',
        fileName: 'bundled-packages.json',
        source: JSON.stringify([...folders].sort()),
      })
    },
  }
}
