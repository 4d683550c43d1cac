import react from '@vitejs/plugin-react'
import { defineConfig } from 'vite'

export default defineConfig({
  base: './',
  plugins: [react()],
  build: {
    outDir: process.env['ARMBLOCKS_OUT'] ?? '../src/armblocks/studio/web',
    emptyOutDir: true,
    assetsInlineLimit: 0, // the page's security policy allows no fonts and pictures but the server's own
    chunkSizeWarningLimit: 1200,
  },
})
