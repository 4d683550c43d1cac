import { ActionIcon, Slider, Text } from '@mantine/core'
import { IconPlayerPauseFilled, IconPlayerPlayFilled } from '@tabler/icons-react'
import { useStudio } from '../store'
import { play, shownTime, useCursor } from './cursor'

/** The time cursor of all views: drag it through the run, or play the run again. */
export function Timeline() {
  const run = useStudio((s) => s.run)
  const time = useCursor((s) => s.time)
  const playing = useCursor((s) => s.playing)
  const stop = run?.stopTime ?? 10
  const at = time ?? run?.time ?? 0
  const label = playing ? 'Hold the playback' : 'Play the run'
  return (
    <footer className="timeline">
      <ActionIcon variant="subtle" color="gray" aria-label={label} disabled={!run} onClick={() => (playing ? useCursor.setState({ playing: false }) : play())}>
        {playing ? <IconPlayerPauseFilled size={15} /> : <IconPlayerPlayFilled size={15} />}
      </ActionIcon>
      <Slider
        className="track"
        size="sm"
        thumbLabel="Time"
        min={0}
        max={stop}
        step={stop / 1000}
        label={null}
        disabled={!run}
        value={Math.min(at, stop)}
        onChange={(value) => useCursor.setState({ time: value, playing: false })}
      />
      <Text size="sm" className="numbers instant">
        {(run ? shownTime() : 0).toFixed(3)} s
      </Text>
    </footer>
  )
}
