import { ActionIcon, Tooltip } from '@mantine/core'
import {
  IconFlipVertical,
  IconLayoutAlignBottom,
  IconLayoutAlignCenter,
  IconLayoutAlignLeft,
  IconLayoutAlignMiddle,
  IconLayoutAlignRight,
  IconLayoutAlignTop,
  IconLayoutDistributeHorizontal,
  IconLayoutDistributeVertical,
  IconPlugX,
  IconRotateClockwise,
} from '@tabler/icons-react'
import { useStudio } from '../store'
import { align, distribute, flip, ground, rotate, selectedBlocks } from './arranging'

const BLOCK_COMMANDS = [
  { label: 'Rotate (Ctrl+R)', icon: IconRotateClockwise, run: rotate },
  { label: 'Flip (Ctrl+I)', icon: IconFlipVertical, run: flip },
  { label: 'Ground and terminate unconnected ports', icon: IconPlugX, run: ground },
]
const ALIGNMENTS = [
  { label: 'Align left edges', icon: IconLayoutAlignLeft, run: () => align('left') },
  { label: 'Align centres', icon: IconLayoutAlignCenter, run: () => align('centre') },
  { label: 'Align right edges', icon: IconLayoutAlignRight, run: () => align('right') },
  { label: 'Align top edges', icon: IconLayoutAlignTop, run: () => align('top') },
  { label: 'Align middles', icon: IconLayoutAlignMiddle, run: () => align('middle') },
  { label: 'Align bottom edges', icon: IconLayoutAlignBottom, run: () => align('bottom') },
]
const DISTRIBUTIONS = [
  { label: 'Equal gaps from left to right', icon: IconLayoutDistributeVertical, run: () => distribute('x') },
  {
    label: 'Equal gaps from top to bottom',
    icon: IconLayoutDistributeHorizontal,
    run: () => distribute('y'),
  },
]

/** Commands for several selected blocks, at the top of the sheet. */
export function ArrangeBar() {
  const count = useStudio(() => selectedBlocks().length)
  const buttons = [...BLOCK_COMMANDS, ...ALIGNMENTS, ...(count > 2 ? DISTRIBUTIONS : [])]
  return (
    <div className="arrange-bar" role="toolbar" aria-label="Arrange the selected blocks">
      {buttons.map(({ label, icon: Icon, run }) => (
        <Tooltip key={label} label={label} openDelay={300}>
          <ActionIcon variant="subtle" color="gray" aria-label={label} onClick={run}>
            <Icon size={17} />
          </ActionIcon>
        </Tooltip>
      ))}
    </div>
  )
}
