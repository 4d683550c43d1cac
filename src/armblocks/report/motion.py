"""Which signals of a run are the motion of which robot.

A block that takes a robot names its ends by the field's letters (q, qd, qdd, tau, poses). This module joins
the ends that belong to one arm; it knows no block by its class.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Block, Diagram, ParameterKind, ViewKind, flat_diagram
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames
from armblocks.simulation.result import SimulationResult

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """One arm's motion: ``q``, ``qd``, ``qdd``, ``tau`` (N, n), ``poses`` (N, L+2, 4, 4) in the world.

    ``notes`` say which of them were not in the diagram and come from differences between samples.
    """

    robot: Robot
    blocks: tuple[str, ...]
    time: _Array
    q: _Array
    qd: _Array
    qdd: _Array
    tau: _Array | None
    poses: _Array
    notes: tuple[str, ...] = ()

    @property
    def tool(self) -> _Array:
        """The tool's path in the world, (N, 3) m."""
        return self.poses[:, -1, :3, 3]


@dataclass(frozen=True, kw_only=True)
class MovingArm:
    """Where one arm's motion stands in the results of a diagram: paths of signals, ``None`` if absent."""

    robot: Robot
    blocks: tuple[str, ...]
    q: str
    qd: str | None
    qdd: str | None
    tau: str | None
    poses: str | None


def robot_of(block: Block) -> Robot | None:
    """The robot that a block works with, if it has one."""
    for rule in type(block).parameters():
        if rule.kind is ParameterKind.ROBOT:
            value: object = getattr(block, rule.name)
            if isinstance(value, Robot):
                return value
    return None


def motions(diagram: Diagram, result: SimulationResult) -> tuple[Motion, ...]:
    """The motion of every robot of a diagram, one for each different signal of joint coordinates."""
    return tuple(_motion(arm, result) for arm in moving_arms(diagram, result))


def moving_arms(diagram: Diagram, result: SimulationResult) -> tuple[MovingArm, ...]:
    """The arms of a diagram and their signals: the same for every run of it."""
    diagram = flat_diagram(diagram)
    groups: dict[tuple[Robot, str], list[str]] = {}
    for name, block in diagram.blocks.items():
        robot = robot_of(block)
        path = _path(result, name, "q")
        if robot is not None and path is not None and result[path].shape[1:] == (robot.n,):
            groups.setdefault((robot, path), []).append(name)
    found: list[MovingArm] = []
    shown = {robot for (robot, _), names in groups.items() if any(_plots(diagram, n) for n in names)}
    for (robot, path), names in groups.items():
        # A controller works out torques for several q of one arm; the arm that is drawn is the real one.
        if robot in shown and not any(_plots(diagram, n) for n in names):
            continue
        found.append(_moving_arm(robot, path, _sources_first(diagram, names), result))
    return tuple(found)


def _plots(diagram: Diagram, name: str) -> bool:
    return any(view.kind is ViewKind.ROBOT for view in diagram.blocks[name].views())


def _path(result: SimulationResult, block: str, port: str) -> str | None:
    """The signal behind ``block/port``, an output, an input or a record; None if there is none."""
    name = f"{block}/{port}"
    return result.resolve(name) if name in result else None


def _sources_first(diagram: Diagram, names: list[str]) -> list[str]:
    """Blocks that give q out (forward dynamics) know the real rates; those that take q may be fed plans."""
    return sorted(names, key=lambda n: "q" not in [port.name for port in diagram.blocks[n].output_ports()])


def _moving_arm(robot: Robot, path: str, names: list[str], result: SimulationResult) -> MovingArm:
    owner, shape = path.rpartition("/")[0], result[path].shape

    def look(port: str) -> str | None:
        # The block that drives q (a trajectory, an integrator) is asked before those that q drives.
        for name in (owner, *names):
            if port == "tau" and f"{name}/qd" not in result:
                continue  # the torque of gravity alone is not what drives the arm
            signal = _path(result, name, port)
            if signal is not None and result[signal].shape == shape:
                return signal
        return None

    return MovingArm(
        robot=robot,
        blocks=tuple(names),
        q=path,
        qd=look("qd"),
        qdd=look("qdd"),
        tau=look("tau"),
        poses=next((p for n in names if (p := _path(result, n, "poses")) is not None), None),
    )


def _motion(arm: MovingArm, result: SimulationResult) -> Motion:
    time, q = result.time, result[arm.q]
    notes: list[str] = []

    def rate(path: str | None, values: _Array, letter: str) -> _Array:
        if path is not None:
            return result[path]
        notes.append(f"{letter} is not in the diagram: differences between samples")
        return np.gradient(values, time, axis=0) if len(time) > 1 else np.zeros_like(values)

    qd = rate(arm.qd, q, "qd")
    qdd = rate(arm.qdd, qd, "qdd")
    poses = (
        np.stack([link_frames(arm.robot, [float(v) for v in row]) for row in q])
        if arm.poses is None
        else result[arm.poses]
    )
    return Motion(
        robot=arm.robot,
        blocks=arm.blocks,
        time=time,
        q=q,
        qd=qd,
        qdd=qdd,
        tau=None if arm.tau is None else result[arm.tau],
        poses=poses,
        notes=tuple(notes),
    )
