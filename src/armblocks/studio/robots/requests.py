"""Requests about the motion of robots, in the editor and in diagrams."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Sequence
from pathlib import Path

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.errors import InputError
from armblocks.multibody.drawn_robots import drawn_robots
from armblocks.rendering.arm_drawing import arm_picture_svg
from armblocks.robot import Robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.requests import DocumentRequests
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.messages import robots as robot_messages
from armblocks.studio.protocol.request_handlers import RequestHandlers
from armblocks.studio.protocol.robot_scene import RobotScene
from armblocks.studio.robots.presenter import RobotPresenter
from armblocks.studio.robots.readings import readings
from armblocks.studio.robots.scene import link_frames_of, scene_of
from armblocks.studio.robots.tables import robot_tables
from armblocks.studio.sheet.nesting import inside
from armblocks.studio.sheet.open_documents import OpenDocuments

_PICTURE_SIZE = (760.0, 560.0)


class RobotRequests:
    """Handles the requests about robots."""

    def __init__(
        self,
        folder: ProjectFolder,
        documents: DocumentRequests,
        presenter: RobotPresenter,
        diagrams: OpenDocuments,
    ) -> None:
        self._folder = folder
        self._documents = documents
        self._presenter = presenter
        self._robots = presenter.files
        self._diagrams = diagrams

    def register(self, handlers: RequestHandlers) -> None:
        """Register the handlers of the requests about robots."""
        handlers.on(robot_messages.RobotOfBlock, self._open_of_block)
        handlers.on(robot_messages.AskRobotTables, self._tables)
        handlers.on(robot_messages.AskScene, self._scene)
        handlers.on(robot_messages.AskPose, self._pose)
        handlers.on(robot_messages.AskPicture, self._picture)
        handlers.on(robot_messages.AskReadings, self._readings)

    async def _open_of_block(self, client: StudioClient, request: robot_messages.RobotOfBlock) -> str:
        robot = self._block_robot(request.document, request.inside, request.block)
        path = Path(robot.source)
        if path.suffix.lower() == ".json" and path.is_relative_to(self._folder.root) and path.is_file():
            opening = self._presenter.open_file(path.relative_to(self._folder.root).as_posix())
            return await self._documents.show(client, opening.opened[0], notes=opening.notes)
        is_shipped = robot.source in formats.list_robots()
        open_file = (
            self._robots.add(robot, origin=robot.source) if is_shipped else self._robots.open_value(robot)
        )
        return await self._documents.show(client, open_file)

    async def _tables(
        self, _: StudioClient, request: robot_messages.AskRobotTables
    ) -> robot_messages.RobotTables:
        return robot_tables()

    async def _scene(self, _: StudioClient, request: robot_messages.AskScene) -> RobotScene:
        scene = scene_of(self._robot(request.document, request.inside, request.block))
        if request.document not in self._robots:
            diagram = self._diagrams[request.document].document.diagram
            if _is_world(diagram, request.inside, request.block):
                start = drawn_robots(diagram)["/".join([*request.inside, request.block])][1]
                return dataclasses.replace(scene, rest=list(start))
        return scene

    async def _pose(self, _: StudioClient, request: robot_messages.AskPose) -> list[list[list[float]]]:
        return link_frames_of(self._robot(request.document, request.inside, request.block), request.q)

    async def _picture(self, _: StudioClient, request: robot_messages.AskPicture) -> str:
        robot = self._robot(request.document, request.inside, request.block)
        link_frames_of(robot, request.q)  # raises for a wrong number of coordinates
        return await asyncio.to_thread(arm_picture_svg, robot, request.q, _PICTURE_SIZE, request.theme)

    async def _readings(
        self, _: StudioClient, request: robot_messages.AskReadings
    ) -> robot_messages.Readings:
        open_file = self._robots[request.document]
        async with open_file.reading:  # concurrent requests compile the arm only once
            return await asyncio.to_thread(readings, open_file.arm, request.q, request.qd, request.qdd)

    def _robot(self, document: str, path: Sequence[str], block: str) -> Robot:
        """Return the robot of a document, or of a block of a diagram."""
        if document in self._robots:
            return self._robots[document].robot
        return self._block_robot(document, path, block)

    def _block_robot(self, document: str, path: Sequence[str], block: str) -> Robot:
        diagram = self._diagrams[document].document.diagram
        if _is_world(diagram, path, block):
            mechanism = drawn_robots(diagram).get("/".join([*path, block]))
            if mechanism is not None:
                return mechanism[0]
        level = inside(diagram, path)
        robot = getattr(level.block(block), "robot", None)
        if not isinstance(robot, Robot):
            raise InputError(
                "the block has no robot",
                where=f"block '{block}'",
                allowed="a robot block",
                fix="choose a block with a robot",
            )
        return robot


def _is_world(diagram: Diagram, path: Sequence[str], block: str) -> bool:
    """Whether a block is a World Frame; its robot is the drawn mechanism that is connected with it."""
    return isinstance(inside(diagram, path).blocks.get(block), BLOCKS["WorldFrame"])
