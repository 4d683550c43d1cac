"""Open files of any kind: undo, versions, save, journals and recovery; the folders of project and state."""
