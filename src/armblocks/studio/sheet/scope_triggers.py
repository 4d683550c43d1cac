"""The trigger of the scopes in the editor: edits, messages to clients, and renamed blocks."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from armblocks.diagram import Diagram, ScopeTrigger
from armblocks.studio.protocol.messages.sheet_edits import ScopeTriggerSettings, SetScopeTrigger
from armblocks.studio.sheet.renames import path_after


def with_trigger(edit: SetScopeTrigger, diagram: Diagram, _context: object) -> Diagram:
    """Return the diagram with the trigger of an edit; without one, its scopes have no trigger."""
    trigger = ScopeTrigger(**edit.trigger.model_dump()) if edit.trigger else None
    return dataclasses.replace(diagram, scope_trigger=trigger)


def trigger_settings(diagram: Diagram) -> ScopeTriggerSettings | None:
    """Return the trigger of a diagram for clients."""
    trigger = diagram.scope_trigger
    return ScopeTriggerSettings(**dataclasses.asdict(trigger)) if trigger else None


def with_consistent_trigger(diagram: Diagram, renamed: Mapping[str, str]) -> Diagram:
    """Return the diagram after a rename: the trigger names its signal by the new path of the block.

    ``renamed``: new paths of blocks by old path.
    """
    trigger = diagram.scope_trigger
    if trigger is None or (signal := path_after(trigger.signal, renamed)) == trigger.signal:
        return diagram
    return dataclasses.replace(diagram, scope_trigger=dataclasses.replace(trigger, signal=signal))
