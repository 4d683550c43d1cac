import './shortcuts.css'
import { Button, Kbd, Modal } from '@mantine/core'
import { IconPrinter } from '@tabler/icons-react'
import { useEffect } from 'react'
import { commands } from './commands'
import { showDialog, useDialogs } from './dialogs'
import { KEYS } from './key_list'
import { keyGroups } from './model/key_groups'

/** `showDialog('keys', PRINT)` opens the key map and prints it. */
const PRINT = 'print'
const OPENING_MS = 400

/** The key map: all keys by the place where they are handled, in two columns; it can be printed. */
export function Shortcuts() {
  const opened = useDialogs((s) => s.open === 'keys')
  const toPrint = useDialogs((s) => s.typed === PRINT)
  useEffect(() => {
    if (!opened || !toPrint) return
    const timer = setTimeout(() => print(), OPENING_MS)
    return () => clearTimeout(timer)
  }, [opened, toPrint])
  return (
    <Modal
      opened={opened}
      onClose={() => showDialog(null)}
      title={
        <span className="key-map-title">
          <b>Keys</b>
          <Button
            size="compact-sm"
            variant="default"
            leftSection={<IconPrinter size={14} />}
            onClick={() => print()}
          >
            Print
          </Button>
        </span>
      }
      size={940}
      yOffset="6vh"
      classNames={{ root: 'key-map-dialog' }}
    >
      <div className="key-map" role="group" aria-label="Keys">
        {keyGroups(commands(), KEYS).map(({ title, keys }) => (
          <section key={title}>
            <h3>{title}</h3>
            <dl>
              {keys.map(([combinations, effect]) => (
                <div key={combinations}>
                  <dt>
                    {combinations.split(', ').map((combination) => (
                      <Kbd key={combination}>{combination}</Kbd>
                    ))}
                  </dt>
                  <dd>{effect}</dd>
                </div>
              ))}
            </dl>
          </section>
        ))}
      </div>
    </Modal>
  )
}
