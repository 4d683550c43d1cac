import '@fontsource-variable/inter/wght.css'
import '@fontsource/jetbrains-mono/400.css'
import '@fontsource/jetbrains-mono/700.css'
import './mantine.css'
import 'dockview-react/dist/styles/dockview.css'
import '@xyflow/react/dist/style.css'
import './tones.css'
import './studio.css'
import { MantineProvider } from '@mantine/core'
import { StrictMode } from 'react'
import { createRoot } from 'react-dom/client'
import { App } from './app'
import { receive } from './events'
import { connection } from './store'
import { theme, themeManager } from './theme'

connection.open(receive)
createRoot(document.getElementById('root')!).render(
  <StrictMode>
    <MantineProvider theme={theme} defaultColorScheme="auto" colorSchemeManager={themeManager}>
      <App />
    </MantineProvider>
  </StrictMode>,
)
