import react from '@vitejs/plugin-react'
import { defineConfig } from 'vite'

import { bundledPackages } from './bundled_packages'

/**
 * Bundles the notebook views as one script and one style sheet; `studio/notebook.py` embeds them in a frame.
 */
export default defineConfig({
  plugins: [react(), bundledPackages()],
  define: { 'process.env.NODE_ENV': '"production"' },
  publicDir: false,
  build: {
    outDir: `${process.env['ARMBLOCKS_OUT'] ?? '../src/armblocks/studio/web'}/notebook`,
    emptyOutDir: true,
    cssCodeSplit: false,
    lib: {
      entry: 'src/notebook/frame.tsx',
      formats: ['iife'],
      name: 'armblocksFrame',
      fileName: () => 'frame.js',
      cssFileName: 'frame',
    },
    chunkSizeWarningLimit: 2500,
  },
})
