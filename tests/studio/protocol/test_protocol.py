"""Requests, reply types and handlers are found without hand-written lists."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_type_hints

import pytest

from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.message import Request, messages_of, reply_type
from armblocks.studio.protocol.messages.pose_edits import PoseEdit
from armblocks.studio.protocol.messages.robot_edits import RobotEdit
from armblocks.studio.protocol.messages.sheet_edits import DiagramEdit
from armblocks.studio.robots.edits import ROBOT_EDITS
from armblocks.studio.robots.pose_edits import POSE_EDITS
from armblocks.studio.server.hub import Hub
from armblocks.studio.sheet.edits import EDITS


def test_every_request_has_a_handler_of_its_reply_type(tmp_path: Path) -> None:
    handlers = Hub(ProjectFolder(tmp_path)).request_handlers.handlers
    assert set(handlers) == set(messages_of(Request).values())
    replies = {request: get_type_hints(handler)["return"] for request, handler in handlers.items()}
    different = {request: reply for request, reply in replies.items() if reply != expected(request)}
    assert different == {}


def expected(request: type[Request[Any]]) -> Any:
    declared = reply_type(request)
    return type(None) if declared is None else declared


def test_every_edit_has_a_function_and_a_title() -> None:
    of_robots = {**ROBOT_EDITS.entries, **POSE_EDITS.entries}
    for entries, edits in ((EDITS.entries, DiagramEdit), (of_robots, RobotEdit)):
        assert set(entries) == set(messages_of(edits).values())
    assert set(POSE_EDITS.entries) == set(messages_of(PoseEdit).values())


def test_a_request_without_a_reply_type_is_refused() -> None:
    class Silent(Request):  # pyright: ignore[reportMissingTypeArgument]
        """A request without a declared reply type."""

    with pytest.raises(TypeError, match="Silent does not declare the type of its reply"):
        reply_type(Silent)
