"""The trigger of the scopes in the editor: its edit, its message, and its signal after renames of blocks."""

from __future__ import annotations

import dataclasses

from armblocks.diagram import Diagram, ScopeTrigger
from armblocks.studio.protocol.messages.sheet_edits import ScopeTriggerSettings, SetScopeTrigger
from armblocks.studio.sheet.renames import path_after, renamed_paths


def with_trigger(edit: SetScopeTrigger, diagram: Diagram, _context: object) -> Diagram:
    """Return the diagram with another trigger of its scopes."""
    trigger = ScopeTrigger(**edit.trigger.model_dump()) if edit.trigger else None
    return dataclasses.replace(diagram, scope_trigger=trigger)


def trigger_settings(diagram: Diagram) -> ScopeTriggerSettings | None:
    """Return the trigger of a diagram for clients."""
    trigger = diagram.scope_trigger
    return ScopeTriggerSettings(**dataclasses.asdict(trigger)) if trigger else None


def with_consistent_trigger(before: Diagram, after: Diagram) -> Diagram:
    """Return the diagram after an edit; the signal of its trigger has the new name of a renamed block."""
    trigger = after.scope_trigger
    if trigger is None:
        return after
    signal = path_after(trigger.signal, renamed_paths(before, after))
    if signal == trigger.signal:
        return after
    return dataclasses.replace(after, scope_trigger=dataclasses.replace(trigger, signal=signal))
