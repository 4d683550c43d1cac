import { ActionIcon, Menu, Tooltip } from '@mantine/core'
import {
  IconArrowsMaximize,
  IconCamera,
  IconEye,
  IconPlayerStopFilled,
  IconVideo,
  IconViewfinder,
} from '@tabler/icons-react'
import { useRef, useState } from 'react'
import type { Entries } from '../context_menu_state'
import type { CameraHandle, Preset } from './camera'
import { videoFormat, recordVideo, type Rendering } from './pictures'
import { useViewOptions, type ViewOptions } from './view_options'

const PRESET_LABELS: [Preset, string][] = [
  ['iso', 'From a corner'],
  ['front', 'From the front'],
  ['side', 'From the side'],
  ['top', 'From above'],
  ['tool', 'From the tool'],
]

const OPTION_LABELS: [keyof ViewOptions, string][] = [
  ['frames', 'Frames of the links'],
  ['axes', 'Axes of the joints'],
  ['limits', 'Ranges of the joints'],
  ['path', 'Path of the tool'],
  ['ghosts', 'Start and goal'],
  ['follow', 'Follow the tool'],
]

interface ViewToolsProps {
  camera: React.RefObject<CameraHandle | null>
  rendering: React.RefObject<Rendering | null>
  name: string
  onPicture: () => void
  playForVideo: (() => Promise<void>) | undefined
  hasPath: boolean
  hasGhosts: boolean
  onToggle: (option: keyof ViewOptions) => void
  children?: React.ReactNode
}

/** The commands of an arm as a context menu. */
export function armEntries(
  camera: CameraHandle | null,
  {
    hasPath,
    hasGhosts,
    onToggle,
    onPicture,
  }: Pick<ViewToolsProps, 'hasPath' | 'hasGhosts' | 'onToggle' | 'onPicture'>,
): Entries {
  const options = useViewOptions.getState()
  return [
    { title: 'Show the whole arm', keys: 'Space', run: () => camera?.fit() },
    {
      title: 'Camera',
      submenu: PRESET_LABELS.map(([preset, title]) => ({ title, run: () => camera?.look(preset) })),
    },
    null,
    ...availableOptions(hasPath, hasGhosts).map(([option, title]) => ({
      title,
      checked: options[option],
      run: () => onToggle(option),
    })),
    null,
    { title: 'Save a picture (PNG)', run: onPicture },
  ]
}

const availableOptions = (hasPath: boolean, hasGhosts: boolean) =>
  OPTION_LABELS.filter(([option]) => (option !== 'path' || hasPath) && (option !== 'ghosts' || hasGhosts))

/** The buttons over an arm: camera, display options, picture and video. */
export function ViewTools({
  camera,
  rendering,
  name,
  onPicture,
  playForVideo,
  hasPath,
  hasGhosts,
  onToggle,
  children,
}: ViewToolsProps) {
  const options = useViewOptions()
  const [recording, setRecording] = useState(false)
  const stop = useRef<() => void>(() => {})
  return (
    <div className="view-tools" role="toolbar" aria-label="Robot view">
      {children}
      <Menu position="bottom-end" shadow="md">
        <Menu.Target>
          <Button label="Camera" icon={IconViewfinder} />
        </Menu.Target>
        <Menu.Dropdown>
          {PRESET_LABELS.map(([preset, label]) => (
            <Menu.Item key={preset} onClick={() => camera.current?.look(preset)}>
              {label}
            </Menu.Item>
          ))}
        </Menu.Dropdown>
      </Menu>
      <Button
        label="Show the whole arm (Space)"
        icon={IconArrowsMaximize}
        onClick={() => camera.current?.fit()}
      />
      <Menu position="bottom-end" shadow="md">
        <Menu.Target>
          <Button label="Display options" icon={IconEye} />
        </Menu.Target>
        <Menu.Dropdown>
          {availableOptions(hasPath, hasGhosts).map(([option, label]) => (
            <Menu.CheckboxItem key={option} checked={options[option]} onChange={() => onToggle(option)}>
              {label}
            </Menu.CheckboxItem>
          ))}
        </Menu.Dropdown>
      </Menu>
      <Button label="Save a picture (PNG)" icon={IconCamera} onClick={onPicture} />
      {playForVideo && videoFormat() && (
        <Button
          label={recording ? 'Stop the video' : 'Record a video of the run'}
          icon={recording ? IconPlayerStopFilled : IconVideo}
          onClick={() => {
            if (recording) {
              stop.current()
              return
            }
            setRecording(true)
            stop.current = recordVideo(rendering, name, playForVideo, () => setRecording(false))
          }}
        />
      )}
    </div>
  )
}

interface ButtonProps extends React.ComponentPropsWithRef<'button'> {
  label: string
  icon: React.ComponentType<{ size: number }>
}

export function Button({ label, icon: Icon, ...rest }: ButtonProps) {
  return (
    <Tooltip label={label} openDelay={400} disabled={rest['aria-expanded'] === true}>
      <ActionIcon variant="subtle" color="gray" aria-label={label} {...rest}>
        <Icon size={16} />
      </ActionIcon>
    </Tooltip>
  )
}
