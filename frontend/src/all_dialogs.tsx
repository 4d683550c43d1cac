import './mantine_later.css'
import { ConnectDialog } from './canvas/connect_dialog'
import { DroppedTableDialog } from './canvas/dropped_table_dialog'
import { SubsystemPreview } from './canvas/subsystem_preview'
import { ContextMenu } from './context_menu'
import { CommandPalette } from './command_palette'
import { Bookmarks } from './documents/bookmarks_dialog'
import { CloseDialog } from './documents/close_dialog'
import { OpenDialog } from './documents/open_dialog'
import { RecoveryDialog } from './documents/recovery_dialog'
import { SaveDialog } from './documents/save_dialog'
import { Tour } from './documents/tour'
import { BlockDialog } from './inspector/block_dialog'
import { MaskDialog } from './inspector/mask_dialog'
import { Find } from './library/find'
import { QuickInsert } from './library/quick_insert'
import { Configuration } from './run/configuration'
import { ParameterSets } from './run/parameter_sets_dialog'
import { Shortcuts } from './shortcuts'

/** All dialogs, in one bundle that is loaded after the first rendering. */
export function AllDialogs() {
  return (
    <>
      <ContextMenu />
      <SubsystemPreview />
      <BlockDialog />
      <MaskDialog />
      <Configuration />
      <ParameterSets />
      <Bookmarks />
      <QuickInsert />
      <ConnectDialog />
      <CommandPalette />
      <Find />
      <Tour />
      <Shortcuts />
      <SaveDialog />
      <CloseDialog />
      <OpenDialog />
      <RecoveryDialog />
      <DroppedTableDialog />
    </>
  )
}
