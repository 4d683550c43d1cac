"""The arm that users hold: a robot whose equations are traced once and compiled to native code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler import Kernel, OperationCount, recall
from armblocks.errors import UnknownNameError
from armblocks.face.payload import Payload
from armblocks.face.robot_html import robot_html
from armblocks.robot import FrictionModel, Robot

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction

Array = NDArray[np.float64]


class OfConfiguration(Protocol):
    """``f(q)``: ``q`` (n,) or (N, n); one result, or N of them stacked. ``out`` receives the result."""

    def __call__(self, q: ArrayLike, /, *, out: Array | None = None, threads: int = 1) -> Array: ...


class OfSpeed(Protocol):
    """``f(qd)``: ``qd`` (n,) or (N, n)."""

    def __call__(self, qd: ArrayLike, /, *, out: Array | None = None, threads: int = 1) -> Array: ...


class OfState(Protocol):
    """``f(q, qd)``: each (n,) or (N, n)."""

    def __call__(
        self, q: ArrayLike, qd: ArrayLike, /, *, out: Array | None = None, threads: int = 1
    ) -> Array: ...


class OfMotion(Protocol):
    """``f(q, qd, qdd or tau)``, with an optional wrench (6,) or (N, 6) and payload."""

    def __call__(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        third: ArrayLike,
        /,
        *,
        wrench: ArrayLike | None = None,
        payload: Payload | ArrayLike | None = None,
        out: Array | None = None,
        threads: int = 1,
    ) -> Array: ...


class OfLoadedMotion(Protocol):
    """``f(q, qd, qdd or tau, wrench, payload)``: the kernel behind :class:`OfMotion` under a load."""

    def __call__(self, *arrays: ArrayLike, out: Array | None = None, threads: int = 1) -> Array: ...


def _zeros(count: int) -> Array:
    zeros = np.zeros(count)
    zeros.flags.writeable = False
    return zeros


_NO_WRENCH, _NO_PAYLOAD = _zeros(6), _zeros(10)


class Arm:
    """A robot ready to compute.

    Every method takes one sample, joint vectors of shape ``(n,)``, or a batch, ``(N, n)``; any float or
    integer dtype, any strides (C-contiguous float64 is fastest). ``out=`` takes a float64 C-contiguous array
    for the result, ``threads=`` spreads a batch. The same input gives the same bits either way. The first
    call of a method compiles it (a fraction of a second, kept on disk for later processes).

    Units are SI: rad or m, N m or N. Frames: world, unless said otherwise.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._kernels: dict[str, Kernel] = {}

    # ---- description -------------------------------------------------------------------------------------
    @property
    def name(self) -> str:
        """The robot's name."""
        return self.robot.name

    @property
    def n(self) -> int:
        """Count of moving joints."""
        return self.robot.n

    def nofriction(self, which: str = "coulomb") -> Arm:
        """The arm without ``"coulomb"``, ``"viscous"`` or ``"all"`` friction (toolbox: ``nofriction``)."""
        kinds = ("coulomb", "viscous", "all")
        if which not in kinds:
            raise UnknownNameError("kind of friction", which, kinds, where=self.name)
        return Arm(self.robot.nofriction(coulomb=which != "viscous", viscous=which != "coulomb"))

    def with_friction_model(self, model: FrictionModel | str) -> Arm:
        """The arm with the friction formula of another toolbox release, see :class:`FrictionModel`."""
        if isinstance(model, str):
            names = {known.value: known for known in FrictionModel}
            if model not in names:
                raise UnknownNameError("friction model", model, names, where=self.name)
            model = names[model]
        return Arm(self.robot.with_friction_model(model))

    # ---- kinematics --------------------------------------------------------------------------------------
    @cached_property
    def fkine(self) -> OfConfiguration:
        """``fkine(q)`` → T (4, 4): pose of the tool in the world."""
        return self._kernel("fkine").entry

    @cached_property
    def link_poses(self) -> OfConfiguration:
        """``link_poses(q)`` → (L + 2, 4, 4): poses in the world of the base, each link and the tool."""
        return self._kernel("link_poses").entry

    @cached_property
    def jacob0(self) -> OfConfiguration:
        """``jacob0(q)`` → J (6, n): tool velocity in world axes per joint speed; linear rows first."""
        return self._kernel("jacob0").entry

    @cached_property
    def jacobe(self) -> OfConfiguration:
        """``jacobe(q)`` → J (6, n): as ``jacob0`` but in tool axes."""
        return self._kernel("jacobe").entry

    @cached_property
    def manipulability(self) -> OfConfiguration:
        """``manipulability(q)`` → Yoshikawa's sqrt(det(J J'))."""
        return self._kernel("manipulability").entry

    # ---- dynamics ----------------------------------------------------------------------------------------
    @cached_property
    def rne(self) -> OfMotion:
        """``rne(q, qd, qdd)`` → tau (n,): joint torques of a motion, motor inertia and friction included.

        ``wrench=`` [fx fy fz mx my mz] in the last link's frame, ``payload=`` a :class:`Payload` at the tool.
        """
        return self._loadable("rne")

    @cached_property
    def accel(self) -> OfMotion:
        """``accel(q, qd, tau)`` → qdd (n,): joint accelerations under torques, friction acting."""
        return self._loadable("accel")

    @cached_property
    def gravload(self) -> OfConfiguration:
        """``gravload(q)`` → (n,): torques that hold the arm at rest."""
        return self._kernel("gravload").entry

    @cached_property
    def inertia(self) -> OfConfiguration:
        """``inertia(q)`` → M (n, n): joint-space mass matrix, motor inertia included."""
        return self._kernel("inertia").entry

    @cached_property
    def coriolis(self) -> OfState:
        """``coriolis(q, qd)`` → C (n, n): ``C qd`` are the velocity torques; dM/dt - 2 C is skew."""
        return self._kernel("coriolis").entry

    @cached_property
    def friction(self) -> OfSpeed:
        """``friction(qd)`` → (n,): joint torques that friction takes, a part of ``rne``, signed as ``qd``."""
        return self._kernel("friction").entry

    @cached_property
    def kinetic_energy(self) -> OfState:
        """``kinetic_energy(q, qd)`` → J, motor inertia included."""
        return self._kernel("kinetic_energy").entry

    @cached_property
    def potential_energy(self) -> OfConfiguration:
        """``potential_energy(q)`` → J, zero where the centre of mass is level with the world's origin."""
        return self._kernel("potential_energy").entry

    @cached_property
    def centre_of_mass(self) -> OfConfiguration:
        """``centre_of_mass(q)`` → (3,) m: of all links, in the world."""
        return self._kernel("centre_of_mass").entry

    # ---- how it was made ---------------------------------------------------------------------------------
    def operation_count(self, method: str) -> OperationCount:
        """Multiplies, adds and other operations in one evaluation of a method, such as ``"rne"``."""
        if method not in _traces():
            raise UnknownNameError("compiled method", method, _traces(), where=self.name)
        return self._kernel(method).count

    @cached_property
    def _description_key(self) -> str:
        """What the equations depend on: everything but how the robot looks and where it was read."""
        links = tuple(replace(link, geometry=None) for link in self.robot.links)
        return hashlib.sha256(repr(replace(self.robot, links=links, source="")).encode()).hexdigest()

    def _kernel(self, method: str) -> Kernel:
        kernel = self._kernels.get(method)
        if kernel is None:
            key = f"robot/{method}/{self._description_key}"
            kernel = self._kernels[method] = recall(key, lambda: _traces()[method](self.robot))
        return kernel

    def _loadable(self, method: str) -> OfMotion:
        """The plain kernel, and the one with wrench and payload as soon as a call names either."""
        plain = self._kernel(method)

        @cache
        def loaded() -> OfLoadedMotion:
            return self._kernel(f"{method}_loaded").entry

        def general(
            *arguments: ArrayLike,
            wrench: ArrayLike | None = None,
            payload: Payload | ArrayLike | None = None,
            out: Array | None = None,
            threads: int = 1,
        ) -> Array:
            if wrench is None and payload is None:
                return plain(*arguments, out=out, threads=threads)
            force = _NO_WRENCH if wrench is None else wrench
            carried = (
                payload.numbers
                if isinstance(payload, Payload)
                else _NO_PAYLOAD
                if payload is None
                else payload
            )
            return loaded()(*arguments, force, carried, out=out, threads=threads)

        return plain.entry_before(general)

    def __repr__(self) -> str:
        return f"<Arm {self.name}: {self.n} joints {self.robot.joint_letters}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: the arm with all joints at zero, and its table."""
        from armblocks.rendering import arm_picture_svg

        return robot_html(self.robot, arm_picture_svg(self.robot, [0.0] * self.n))


def _traces() -> Mapping[str, Callable[[Robot], TracedFunction]]:
    """All traced quantities; imported late, because a warm cache needs no tracing."""
    from armblocks.dynamics import TRACES

    return TRACES
