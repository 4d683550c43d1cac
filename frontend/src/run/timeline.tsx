import { ActionIcon, Button, NativeSelect, Slider, Text, Tooltip } from '@mantine/core'
import { IconPlayerPauseFilled, IconPlayerPlayFilled, IconRepeat, IconTag } from '@tabler/icons-react'
import { ask, useStudio } from '../store'
import { useShownValues } from './shown_values'
import { pausePlayback, play, shownTime, stepCursor, useCursor } from './cursor'

const RATES = ['0.1', '0.25', '0.5', '1', '2', '5', '10'].map((value) => ({ value, label: `${value} ×` }))
const SHIFT_STEP = 10

/**
 * The time cursor of all views: drag it, or play the recorded run. `wires`: show the button for wire values.
 */
export function Timeline({ wires = false }: { wires?: boolean }) {
  const run = useStudio((s) => s.run)
  const { time, playing, loop, rate } = useCursor()
  const stop = run?.stopTime ?? 10
  const displayedTime = time ?? run?.time ?? 0
  const label = playing ? 'Pause the playback' : 'Play the run'
  const handleKey = (event: React.KeyboardEvent) => {
    if (event.target instanceof HTMLSelectElement || event.ctrlKey || event.metaKey) return
    const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key]
    if (step) stepCursor(event.shiftKey ? SHIFT_STEP * step : step)
    else if (event.key === ' ' && run && playing) pausePlayback()
    else if (event.key === ' ' && run) play()
    else return
    event.preventDefault()
    event.stopPropagation()
  }
  return (
    <footer className="timeline" onKeyDownCapture={handleKey}>
      <Tooltip label={`${label} (Space)`} openDelay={400}>
        <ActionIcon
          variant="subtle"
          color="gray"
          aria-label={label}
          disabled={!run}
          onClick={() => (playing ? pausePlayback() : play())}
        >
          {playing ? <IconPlayerPauseFilled size={15} /> : <IconPlayerPlayFilled size={15} />}
        </ActionIcon>
      </Tooltip>
      <Tooltip label="Loop the playback" openDelay={400}>
        <ActionIcon
          variant={loop ? 'light' : 'subtle'}
          color={loop ? 'accent' : 'gray'}
          aria-label="Loop"
          aria-pressed={loop}
          onClick={() => useCursor.setState({ loop: !loop })}
        >
          <IconRepeat size={15} />
        </ActionIcon>
      </Tooltip>
      <NativeSelect
        size="xs"
        w={74}
        aria-label="Playback rate"
        data={RATES}
        value={String(rate)}
        onChange={(event) => useCursor.setState({ rate: Number(event.currentTarget.value) })}
      />
      <Slider
        className="track"
        size="sm"
        thumbLabel="Time"
        min={0}
        max={stop}
        step={stop / 1000}
        label={null}
        disabled={!run}
        value={Math.min(displayedTime, stop)}
        onChange={(value) => useCursor.setState({ time: value, playing: false })}
      />
      <ReturnToTime />
      {wires && <ValuesToggle />}
      <Text size="sm" className="numbers instant">
        {(run ? shownTime() : 0).toFixed(3)} s
      </Text>
    </footer>
  )
}

/** Returns a paused run to the displayed time. */
function ReturnToTime() {
  const run = useStudio((s) => s.run)
  const time = useCursor((s) => s.time)
  if (run?.state !== 'paused' || time === null || time >= run.time) return null
  return (
    <Tooltip
      label="Return the run to this time: later samples are deleted, tuned values are kept"
      multiline
      w={260}
    >
      <Button
        size="compact-xs"
        variant="default"
        onClick={() =>
          void ask({ kind: 'rewind', run: run.run, time }).then(() =>
            useCursor.setState({ time: null, playing: false }),
          )
        }
      >
        Return to this time
      </Button>
    </Tooltip>
  )
}

function ValuesToggle() {
  const showsAll = useShownValues((s) => s.all)
  return (
    <Tooltip label="Values on all wires" openDelay={400}>
      <ActionIcon
        variant={showsAll ? 'light' : 'subtle'}
        color={showsAll ? 'accent' : 'gray'}
        aria-label="Values on all wires"
        aria-pressed={showsAll}
        onClick={() => useShownValues.setState({ all: !showsAll })}
      >
        <IconTag size={15} />
      </ActionIcon>
    </Tooltip>
  )
}
