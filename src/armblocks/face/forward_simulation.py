"""``Arm.fdyn``: the motion of an arm under joint torques, simulated as a diagram with the arm in it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError
from armblocks.face.assembly import coordinates
from armblocks.face.trajectory_arguments import positive
from armblocks.robot import Robot

Array = NDArray[np.float64]
TorqueLaw: TypeAlias = Callable[..., Any]
"""``tau = law(…)`` with any of the arguments ``t``, ``q`` and ``qd``."""

ARGUMENTS = ("t", "q", "qd")


@dataclass(frozen=True, eq=False, kw_only=True)
class ArmMotionResult(metaclass=ArgumentErrors):
    """A simulated motion: times ``t`` (N,) s, ``q`` (N, nq), ``qd``, ``qdd`` and ``tau`` (N, n).

    ``t, q, qd = arm.fdyn(…)`` unpacks it in the order of the toolbox.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[Array]:
        return iter((self.t, self.q, self.qd))


def simulate_arm(
    robot: Robot,
    duration: float,
    torque: TorqueLaw | ArrayLike | None,
    q0: ArrayLike | None,
    qd0: ArrayLike | None,
    sample_time: float | None,
    dt: float,
    settings: dict[str, Any],
) -> ArmMotionResult:
    """Simulate an arm for ``duration`` s, see :meth:`armblocks.Arm.fdyn`."""
    from armblocks import blocks
    from armblocks.diagram import DiagramBuilder
    from armblocks.face.model import simulate

    where = f"fdyn of robot '{robot.name}'"
    duration, dt = positive("duration", duration, "s", where), positive("dt", dt, "s", where)
    q = robot.neutral if q0 is None else coordinates(robot, "q0", q0, robot.nq)
    qd = np.zeros(robot.nv) if qd0 is None else coordinates(robot, "qd0", qd0, robot.nv)
    builder = DiagramBuilder("fdyn")
    sticks = any(link.motor is not None and any(link.motor.coulomb_friction) for link in robot.links)
    plant_class = blocks.ArmPlant if sticks else blocks.ForwardDynamics
    plant = builder.add("arm", plant_class(robot=robot, q0=q, qd0=qd))
    if callable(torque):
        law = _law_block(torque, robot.nv, sample_time, where)
        source = builder.add("torque", law)
        for port in law.input_ports():
            builder.connect(plant[port.name], source[port.name])
    else:
        constant = np.zeros(robot.nv) if torque is None else coordinates(robot, "torque", torque, robot.nv)
        source = builder.add("torque", blocks.Constant(value=constant))
    builder.connect(source[_OUTPUT if callable(torque) else "y"], plant["tau"])
    result = simulate(builder.build(), stop_time=duration, sample_time=dt, **settings)
    tau = np.asarray(result["arm/tau"]).reshape(len(result.time), robot.nv)
    return ArmMotionResult(
        t=result.time, q=result["arm/q"], qd=result["arm/qd"], qdd=result["arm/qdd"], tau=tau
    )


_OUTPUT = "tau"


def _law_block(torque: TorqueLaw, n: int, sample_time: float | None, where: str) -> Any:
    """The block of a torque law: traced and compiled, or called at every tick."""
    from armblocks import blocks
    from armblocks.diagram import UserFunction

    unknown = [name for name in UserFunction(torque).arguments if name not in ARGUMENTS]
    if unknown:
        raise InputError(
            f"the torque function has the argument '{unknown[0]}'",
            where=where,
            allowed="t, q and qd, or some of them",
            fix="write def torque(t, q, qd), and give other arguments a default",
        )
    if sample_time is None:
        return blocks.PythonFunction(function=torque, results=_OUTPUT)
    if n == 1:  # the result of a block of one number is a scalar
        torque = _as_number(torque)
    return blocks.CalledPythonFunction(
        function=torque, results=_OUTPUT, shapes=str(n), sample_time=sample_time
    )


def _as_number(torque: TorqueLaw) -> TorqueLaw:
    @functools.wraps(torque)
    def law(**arguments: object) -> object:
        value = np.asarray(torque(**arguments))
        return value.item() if value.size == 1 else value

    return law
