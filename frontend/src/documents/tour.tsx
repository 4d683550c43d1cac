import { Button, CloseButton, Group, Paper, Text } from '@mantine/core'
import { useEffect, useLayoutEffect, useState } from 'react'
import { openTour, useTour } from '../dialogs'
import { useStudio } from '../store'

const SEEN_KEY = 'armblocks-tour-seen'
/** Width of the text, and its distance from the highlighted element, px. */
const WIDTH = 320
const GAP = 14

interface Stop {
  /** Selectors of the highlighted element; the first existing one is used. */
  at: string
  title: string
  text: string
}

const STOPS: Stop[] = [
  {
    at: '.sheet',
    title: 'The sheet',
    text:
      'Blocks and wires of the model. Drag from port to port to wire, or to the empty sheet to add a ' +
      'connected block; double-click a block to open it; drag with the right button to duplicate ' +
      'it. A right click lists the commands, Ctrl+Shift+X comments blocks out.',
  },
  {
    at: '.sheet',
    title: 'A readable sheet',
    text:
      'A right click on a block chooses its colour and the side of its name; a double click on a wire ' +
      'names its signal. While you drag a block, thin lines show its alignment with others.',
  },
  {
    at: '.sheet',
    title: 'Wires without drawing',
    text:
      'Ctrl+click a block to connect the selected block to it; drag the end of a wire to another input. ' +
      'Ctrl+Del deletes a block and connects its neighbours. Shift+click selects several blocks, ' +
      '2 zooms to them.',
  },
  {
    at: '.palette',
    title: 'The library',
    text:
      'All blocks by family. Drag a block to the sheet, or onto a wire to insert it. Faster: type its name ' +
      'on the sheet.',
  },
  {
    at: '.run-controls',
    title: 'Run',
    text:
      'Run (Ctrl+Enter), pause (Ctrl+.), step (Ctrl+→, Ctrl+←), stop. To the right: stop time and speed ' +
      'relative to real time.',
  },
  {
    at: '.scopes-panel, .chart',
    title: 'Scopes',
    text:
      'Recorded signals, also by a double click on a Scope: zoom with the mouse, measure between ' +
      'cursors, export. Click a wire on the sheet to log its signal as well.',
  },
  {
    at: '.timeline',
    title: 'The time cursor',
    text: 'Drag the cursor or play the run: scopes, values on wires and the arm all show this time.',
  },
  {
    at: '.robot',
    title: 'The arm',
    text:
      'Turn the view with the mouse. The pose follows the signals at the time cursor. Edit this robot ' +
      'opens its tables; there, Teach lets you drag the tool, record poses and run a motion.',
  },
  {
    at: '[aria-label="Menu"]',
    title: 'Next steps',
    text:
      'New diagrams, files and examples are in this menu; Alt+PageDown shows the next open document. ' +
      'Ctrl+K finds every command, Ctrl+F every block, Ctrl+B bookmarks a view, ? lists all keys.',
  },
]

function closeTour(): void {
  useTour.setState({ stop: null })
  localStorage.setItem(SEEN_KEY, 'yes')
}

/** A tour of the studio, about two minutes; offered at the first visit and in the menu. */
export function Tour() {
  const { stop } = useTour()
  const offered = useStudio((s) => s.document !== null)
  const [box, setBox] = useState<DOMRect | null>(null)
  const [answered, setAnswered] = useState(() => localStorage.getItem(SEEN_KEY) === 'yes')
  const current = stop === null ? undefined : STOPS[stop]
  useLayoutEffect(() => {
    const element = current && document.querySelector(current.at)
    setBox(element ? element.getBoundingClientRect() : null)
  }, [current])
  useEffect(() => {
    if (stop === null) return
    const onKey = (event: KeyboardEvent) => {
      if (event.key !== 'Escape') return
      closeTour()
      event.stopPropagation()
    }
    addEventListener('keydown', onKey, true)
    return () => removeEventListener('keydown', onKey, true)
  }, [stop])
  if (!current) {
    if (answered || !offered) return null
    return <Offer done={() => setAnswered(true)} />
  }
  const last = stop === STOPS.length - 1
  return (
    <>
      {box && (
        <div
          className="tour-mark"
          style={{ left: box.x, top: box.y, width: box.width, height: box.height }}
        />
      )}
      <Paper
        className="tour"
        withBorder
        shadow="lg"
        p="sm"
        role="dialog"
        aria-label={current.title}
        style={beside(box)}
      >
        <Group justify="space-between" wrap="nowrap">
          <Text fw={600}>{current.title}</Text>
          <CloseButton size="sm" aria-label="Leave the tour" onClick={closeTour} />
        </Group>
        <Text size="sm" my={6}>
          {current.text}
        </Text>
        <Group justify="space-between">
          <Text size="xs" c="dimmed">
            {stop! + 1} of {STOPS.length}
          </Text>
          <Group gap="xs">
            {stop! > 0 && (
              <Button
                size="compact-sm"
                variant="default"
                onClick={() => useTour.setState({ stop: stop! - 1 })}
              >
                Back
              </Button>
            )}
            <Button
              size="compact-sm"
              data-autofocus
              autoFocus
              key={stop}
              onClick={() => (last ? closeTour() : useTour.setState({ stop: stop! + 1 }))}
            >
              {last ? 'Done' : 'Next'}
            </Button>
          </Group>
        </Group>
      </Paper>
    </>
  )
}

/** Offers the tour at the first visit. */
function Offer({ done }: { done: () => void }) {
  const answer = () => {
    localStorage.setItem(SEEN_KEY, 'yes')
    done()
  }
  return (
    <Paper className="tour offer" withBorder shadow="md" p="sm" role="dialog" aria-label="A first look">
      <Text size="sm" fw={600}>
        New here? The tour takes two minutes.
      </Text>
      <Group gap="xs" mt={8}>
        <Button size="compact-sm" onClick={() => (answer(), openTour())}>
          Take the tour
        </Button>
        <Button size="compact-sm" variant="default" onClick={answer}>
          Not now
        </Button>
      </Group>
    </Paper>
  )
}

/** Position of the text: right of the element, else left of it, else over its centre. */
function beside(box: DOMRect | null): React.CSSProperties {
  if (!box) return { left: (innerWidth - WIDTH) / 2, top: innerHeight / 3, width: WIDTH }
  const top = Math.min(Math.max(box.y + 8, 8), innerHeight - 190)
  if (box.right + GAP + WIDTH < innerWidth) return { left: box.right + GAP, top, width: WIDTH }
  if (box.x - GAP - WIDTH > 0) return { left: box.x - GAP - WIDTH, top, width: WIDTH }
  return {
    left: box.x + (box.width - WIDTH) / 2,
    top: box.y > 220 ? box.y - 170 : Math.min(box.bottom + GAP, innerHeight - 190),
    width: WIDTH,
  }
}
