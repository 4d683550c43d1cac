import '../mantine.css'
import '../tones.css'
import '../studio.css'
import '../robot/robot.css'
import './frame.css'
import { MantineProvider } from '@mantine/core'
import { StrictMode } from 'react'
import { createRoot } from 'react-dom/client'
import { ContextMenu } from '../context_menu'
import type { Channel, SinkView } from '../protocol'
import { RunArm } from '../robot/run_arm'
import { posesFromRows, type RobotScene } from '../robot/scene'
import { play, useCursor } from '../run/cursor'
import { Timeline } from '../run/timeline'
import { RunSamples } from '../model/run_samples'
import { showSamples } from '../samples'
import { Scopes } from '../scopes/scopes'
import { useStudio } from '../store'
import { theme } from '../theme'
import { onJoints, receivePoses, useJoints, type SliderOfJoint } from './joints'
import { PosedArm } from './posed_arm'
import { shareCursor } from './shared_cursor'

/** The message with the views to show. */
interface ShowMessage {
  kind: 'show'
  dark: boolean
  /** The key of a result; views of the same result share one time cursor. */
  key: string
  run: { stopTime: number; channels: Channel[]; views: SinkView[]; aliases: Record<string, string> } | null
  frame: ArrayBuffer
  scopes: boolean
  arm: { path: string; scene: RobotScene; rest: number[][][]; drawing: string } | null
  /** A slider for each coordinate of the arm; null for a recorded motion. */
  joints?: { sliders: SliderOfJoint[]; q: number[] } | null
  /** Whether the playback starts automatically. */
  play?: boolean
}

/** The messages from the notebook to this frame; see `studio/notebook.py`. */
type Message =
  | ShowMessage
  | { kind: 'time'; time: number }
  | { kind: 'theme'; dark: boolean }
  | { kind: 'poses'; q: number[]; poses: number[][][] }
  | { kind: 'live'; live: boolean }

let lastMessage: ShowMessage | undefined

function show(message: ShowMessage): void {
  const { key, run, frame } = message
  if (run) {
    const runSamples = new RunSamples(key, run.channels, run.aliases)
    runSamples.receive(frame)
    runSamples.close()
    showSamples(runSamples)
    useStudio.setState({
      run: {
        ...run,
        run: key,
        state: 'done',
        time: run.stopTime,
        realTimeFactor: 0,
        message: '',
        fault: null,
        solver: '',
        reason: '',
        tunables: [],
      },
    })
  }
  if (message.joints && message.arm)
    useJoints.setState({ q: message.joints.q, poses: message.arm.rest, count: 1, live: true })
  lastMessage = message
  draw()
  if (message.play) {
    useCursor.setState({ loop: true })
    play()
  }
}

function draw(): void {
  if (!lastMessage) return
  const { dark, run, scopes, arm, joints } = lastMessage
  const scheme = dark ? 'dark' : 'light'
  // The provider sets the attribute after the effects of its children, in which the plots read their colours.
  document.documentElement.dataset['mantineColorScheme'] = scheme
  root.render(
    <StrictMode>
      <MantineProvider theme={theme} defaultColorScheme={scheme} forceColorScheme={scheme}>
        <main className="notebook-views">
          <div className="beside">
            {run && scopes && <Scopes />}
            {arm && joints && (
              <PosedArm
                scene={arm.scene}
                sliders={joints.sliders}
                drawing={() => Promise.resolve(arm.drawing)}
              />
            )}
            {arm && !joints && (
              <RunArm
                path={arm.path}
                scene={arm.scene}
                rest={posesFromRows(arm.rest)}
                drawing={() => Promise.resolve(arm.drawing)}
              />
            )}
          </div>
          {run && <Timeline />}
        </main>
        <ContextMenu />
      </MantineProvider>
    </StrictMode>,
  )
}

const root = createRoot(document.getElementById('root')!)
const cursor = shareCursor((time) => parent.postMessage({ kind: 'time', time }, '*'))
onJoints((q) => parent.postMessage({ kind: 'joints', q }, '*'))
addEventListener('message', ({ source, data }: MessageEvent<Message>) => {
  if (source !== parent) return
  if (data.kind === 'time') cursor.show(data.time)
  else if (data.kind === 'poses') receivePoses(data.q, data.poses)
  else if (data.kind === 'live') useJoints.setState({ live: data.live })
  else if (data.kind === 'theme') {
    lastMessage = lastMessage && { ...lastMessage, dark: data.dark }
    draw()
  } else {
    cursor.join(data.key)
    show(data)
  }
})
parent.postMessage({ kind: 'ready' }, '*')
