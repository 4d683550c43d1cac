"""Finds the signals of a run that are the motion of each robot.

The ports of all blocks with a robot have the names q, qd, qdd, tau and poses. This module groups the ports
that belong to one arm by these names, without the classes of the blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Block, Diagram, ParameterKind, ViewKind, flat_diagram
from armblocks.robot import FrictionModel, Robot
from armblocks.robot.configurations import Configurations
from armblocks.robot.geometry import link_frames
from armblocks.simulation.result import SimulationResult

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """One arm's motion: ``q`` (N, nq), ``qd``, ``qdd``, ``tau`` (N, n), world ``poses`` (N, L+2, 4, 4).

    ``notes`` list the quantities that are not in the diagram and are computed by finite differences.
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
    """The paths of the signals of one arm's motion in the results of a diagram; ``None`` if absent."""

    robot: Robot
    blocks: tuple[str, ...]
    q: str
    qd: str | None
    qdd: str | None
    tau: str | None
    poses: str | None


def robot_of(block: Block) -> Robot | None:
    """The robot of a block, if it has one."""
    for rule in type(block).parameters():
        if rule.kind is ParameterKind.ROBOT:
            value: object = getattr(block, rule.name)
            if isinstance(value, Robot):
                return value
    return None


def motions(diagram: Diagram, result: SimulationResult) -> tuple[Motion, ...]:
    """The motions of the robots of a diagram, one for each different signal of joint coordinates."""
    return tuple(_motion(arm, result) for arm in moving_arms(diagram, result))


def moving_arms(diagram: Diagram, result: SimulationResult) -> tuple[MovingArm, ...]:
    """The arms of a diagram and their signals, which are the same for every run.

    Blocks that read the ``q`` of a simulated arm belong to this arm, also if their robots have other masses
    or drives. An example is a controller with a model of the arm.
    """
    diagram = flat_diagram(diagram)
    groups: dict[tuple[Robot, str], list[str]] = {}
    for name, block in diagram.blocks.items():
        robot = robot_of(block)
        path = _path(result, name, "q")
        if robot is not None and path is not None and result[path].shape[1:] == (robot.nq,):
            owner = diagram.blocks.get(path.rpartition("/")[0])
            simulated = None if owner is None else robot_of(owner)
            if simulated is not None and simulated is not robot and _pictured(robot) == _pictured(simulated):
                robot = simulated
            groups.setdefault((robot, path), []).append(name)
    arms: list[MovingArm] = []
    robots_with_views = {
        robot for (robot, _), names in groups.items() if any(_has_robot_view(diagram, n) for n in names)
    }
    for (robot, path), names in groups.items():
        # Of several q of one arm (reference and simulated), only those of a robot view are drawn.
        if robot in robots_with_views and not any(_has_robot_view(diagram, n) for n in names):
            continue
        arms.append(_moving_arm(robot, path, _sources_first(diagram, names), result))
    return tuple(arms)


@lru_cache(maxsize=32)
def _pictured(robot: Robot) -> Robot:
    """The robot without the parameters that no picture of its motion shows: masses and drives."""
    return replace(
        robot,
        name="robot",
        manufacturer="",
        comment="",
        links=tuple(
            replace(link, mass=0.0, centre_of_mass=(0.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0), motor=None)
            for link in robot.links
        ),
        gravity=(0.0, 0.0, 0.0),
        friction_model=FrictionModel.SQUARED_GEAR,
        springs=(),
        configurations=Configurations(),
    )


def _has_robot_view(diagram: Diagram, name: str) -> bool:
    return any(view.kind is ViewKind.ROBOT for view in diagram.blocks[name].views())


def _path(result: SimulationResult, block: str, port: str) -> str | None:
    """The signal of ``block/port``: an output, an input or a recorded value; None if there is none."""
    name = f"{block}/{port}"
    return result.resolve(name) if name in result else None


def _sources_first(diagram: Diagram, names: list[str]) -> list[str]:
    """The blocks; blocks that output q (forward dynamics) come first.

    Their speeds are simulated; the inputs of other blocks may be planned values.
    """
    return sorted(names, key=lambda n: "q" not in [port.name for port in diagram.blocks[n].output_ports()])


def _moving_arm(robot: Robot, path: str, names: list[str], result: SimulationResult) -> MovingArm:
    owner, shape = path.rpartition("/")[0], (len(result.time), robot.n)

    def signal_of(port: str) -> str | None:
        # The source of q (a trajectory, an integrator) precedes the blocks that q is connected to.
        for name in (owner, *names):
            if port == "tau" and f"{name}/qd" not in result:
                continue  # the gravity torque alone does not drive the arm
            signal = _path(result, name, port)
            if signal is not None and result[signal].shape == shape:
                return signal
        return None

    return MovingArm(
        robot=robot,
        blocks=tuple(names),
        q=path,
        qd=signal_of("qd"),
        qdd=signal_of("qdd"),
        tau=signal_of("tau"),
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
    if arm.qd is None:
        qd = _speeds(arm.robot, q, qd)
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


def _speeds(robot: Robot, q: _Array, rates: _Array) -> _Array:
    """The speeds (N, n) of coordinates ``q`` with the ``rates`` dq/dt, both (N, nq).

    The angular velocity of a ball joint is the vector part of ``2 conj(Q) dQ/dt / Q²`` for its quaternion Q.
    """
    columns: list[_Array] = []
    position = 0
    for joint in robot.joints:
        for motion in joint.motions:
            count = len(motion.positions)
            Q, Qd = q[:, position : position + count], rates[:, position : position + count]
            position += count
            if motion.speeds == motion.positions:
                columns.append(Qd)
            else:
                w, v = Q[:, :1], Q[:, 1:]
                vector = w * Qd[:, 1:] - Qd[:, :1] * v - np.cross(v, Qd[:, 1:])
                columns.append(2.0 * vector / (Q * Q).sum(axis=1, keepdims=True))
    return np.concatenate(columns, axis=1)
