"""Requests that teach an arm: dragging of its tool, motions through its recorded poses, the workspace."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, TypeVar

from armblocks.errors import FormatError, UnknownNameError
from armblocks.face.arm import Arm
from armblocks.robot import Configuration
from armblocks.studio.documents.project_folder import ProjectFolder, check_file_name
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.messages import teaching as teaching_messages
from armblocks.studio.protocol.request_handlers import RequestHandlers
from armblocks.studio.robots.motions import Plan, plan, planned_motion, workspace
from armblocks.studio.robots.open_robots import OpenRobots
from armblocks.studio.robots.reaching import reached

Result = TypeVar("Result")
SUFFIXES = (".csv",)


class TeachingRequests:
    """Handles the requests that teach an arm."""

    def __init__(self, folder: ProjectFolder, robots: OpenRobots) -> None:
        self._folder = folder
        self._robots = robots

    def register(self, handlers: RequestHandlers) -> None:
        """Register the handlers of these requests."""
        handlers.on(teaching_messages.AskReach, self._reach)
        handlers.on(teaching_messages.AskMotion, self._motion)
        handlers.on(teaching_messages.AskMotionRows, self._rows)
        handlers.on(teaching_messages.SaveMotion, self._save)
        handlers.on(teaching_messages.AskWorkspace, self._workspace)

    async def _reach(self, _: StudioClient, request: teaching_messages.AskReach) -> teaching_messages.Reached:
        return await self._computed(request.document, lambda arm, _: reached(arm, request.q, request.target))

    async def _motion(
        self, _: StudioClient, request: teaching_messages.AskMotion
    ) -> teaching_messages.PlannedMotion:
        return await self._computed(
            request.document,
            lambda arm, poses: planned_motion(arm, _plan(arm, poses, request)),
        )

    async def _rows(self, _: StudioClient, request: teaching_messages.AskMotionRows) -> list[list[float]]:
        return await self._computed(
            request.document,
            lambda arm, poses: _plan(arm, poses, request).trajectory.rows().tolist(),
        )

    async def _save(self, _: StudioClient, request: teaching_messages.SaveMotion) -> str:
        path = self._folder.path(request.path, SUFFIXES)
        check_file_name(request.path)
        if path.exists() and not request.overwrite:
            raise FormatError(
                f"the file '{request.path}' exists",
                where="project folder",
                allowed="a new file, or overwriting",
                fix="choose another name, or overwrite the file",
            )
        await self._computed(
            request.document,
            lambda arm, poses: _plan(arm, poses, request).trajectory.save(path),
        )
        return request.path

    async def _workspace(self, _: StudioClient, request: teaching_messages.AskWorkspace) -> str:
        return await self._computed(request.document, lambda arm, _: workspace(arm))

    async def _computed(
        self, document: str, compute: Callable[[Arm, tuple[Configuration, ...]], Result]
    ) -> Result:
        """The result of a computation with the compiled arm and its recorded poses, in a thread."""
        open_file = self._robots[document]
        async with open_file.reading:  # concurrent requests compile the arm only once
            return await asyncio.to_thread(compute, open_file.arm, open_file.robot.configurations.entries)


def _plan(arm: Arm, poses: tuple[Configuration, ...], request: teaching_messages.MotionRequest[Any]) -> Plan:
    """The requested motion. Raises UnknownNameError for the name of a pose that is not recorded."""
    if request.poses is not None:
        unknown = sorted({*request.poses} - {pose.name for pose in poses})
        if unknown:
            names = [pose.name for pose in poses]
            raise UnknownNameError("recorded pose", unknown[0], names, where=f"robot '{arm.name}'")
        poses = tuple(pose for pose in poses if pose.name in request.poses)
    return plan(arm, poses, request.course, request.duration)
