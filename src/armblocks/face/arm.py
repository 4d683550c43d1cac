"""The class ``Arm``: a robot whose equations are traced once and compiled to native code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.compiler import Kernel, OperationCount, cached_kernel
from armblocks.compiler.arguments import check_count, in_order
from armblocks.errors import InputError, UnknownNameError, counted
from armblocks.face.arm_functions import (
    ConfigurationFunction,
    DifferenceFunction,
    DrivenStateFunction,
    FrameFunction,
    IntegrateFunction,
    MotionFunction,
    SpeedFunction,
    StateFunction,
)
from armblocks.face.assembly import Assembly, assemble, coordinates
from armblocks.face.ikine_branches import ClosedForm, IkineBranches, chosen_branch, configuration_of
from armblocks.face.ikine_result import IkineResult
from armblocks.face.notebook_views import robot_view
from armblocks.face.parametric import ParametricArm
from armblocks.face.payload import Payload, payload_numbers
from armblocks.robot import FrictionModel, Robot
from armblocks.robot.dh_table import kinematics_text
from armblocks.robot.fields import check_kind

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction
    from armblocks.face.ikine_search import ArmSearch
    from armblocks.face.ikine_targets import Target
    from armblocks.face.trajectory import JointTrajectory
    from armblocks.pictures.film import FilmProgress

Array = NDArray[np.float64]


_NO_WRENCH = np.zeros(6)
_NO_WRENCH.flags.writeable = False
_OPTIONS = ("wrench", "payload", "out", "threads")


class Arm(metaclass=ArgumentErrors):
    """A robot with compiled kinematics and dynamics.

    Arguments are positional or keywords, ``rne(q, qd, qdd)`` or ``rne(q=q, qd=qd, qdd=qdd)``; positional
    arguments are faster for one sample.

    Every method takes one sample, joint vectors of shape ``(n,)``, or a batch, ``(N, n)``; any float or
    integer dtype, any strides (C-contiguous float64 is fastest). ``out=`` takes a float64 C-contiguous array
    for the result, ``threads=`` distributes a batch over threads. Samples and batches give exactly the same
    results. The first call of a method compiles it (a fraction of a second; cached on disk for later
    processes).

    ``q`` has the shape ``(nq,)``, which differs from ``(n,)`` for robots with spherical or free joints: their
    coordinates contain quaternions w x y z. Results depend only on the direction of a quaternion, and are NaN
    for a quaternion of zeros. :meth:`neutral`, :meth:`integrate` and :meth:`difference` replace zeros, sums
    and differences of coordinates.

    ``near`` (nq,): coordinates of a robot with closed loops near which its constraints can be assembled.
    There ``accel``, ``rne`` and ``gravload`` find which of the equations of the loops are independent. By
    default they search near the neutral configuration, and then within the ranges of the joints.

    Units are SI: rad or m, N m or N. Frames: world, unless stated otherwise.
    """

    def __init__(self, robot: Robot, near: ArrayLike | None = None) -> None:
        check_kind(robot, Robot, where="Arm")
        self.robot = robot
        self._near = None if near is None else coordinates(robot, "near", near, robot.nq)
        self._kernels: dict[str, Kernel] = {}
        self._searches: dict[tuple[str | None, str], ArmSearch] = {}

    def __reduce__(self) -> tuple[type[Arm], tuple[object, ...]]:
        """Pickle and copy the robot alone; code is compiled again or loaded from the cache."""
        return Arm, (self.robot, self._near)

    # ---- description -------------------------------------------------------------------------------------
    @property
    def name(self) -> str:
        """The robot's name."""
        return self.robot.name

    @property
    def n(self) -> int:
        """Number of degrees of freedom: the length of ``qd``, ``qdd`` and ``tau`` (``nv``)."""
        return self.robot.n

    @property
    def nq(self) -> int:
        """Number of joint coordinates: the length of ``q``. It exceeds ``n`` by one for each ball joint."""
        return self.robot.nq

    @property
    def nv(self) -> int:
        """Number of joint speeds, ``n``."""
        return self.robot.nv

    def neutral(self) -> Array:
        """The coordinates q (nq,) without joint motion: 0, and the quaternion 1 0 0 0 of a ball joint."""
        return self.robot.neutral

    def nofriction(self, which: str = "coulomb") -> Arm:
        """The arm without ``"coulomb"``, ``"viscous"`` or ``"all"`` friction (toolbox: ``nofriction``)."""
        kinds = ("coulomb", "viscous", "all")
        if which not in kinds:
            raise UnknownNameError("kind of friction", which, kinds, where=self.name)
        robot = self.robot.nofriction(coulomb=which != "viscous", viscous=which != "coulomb")
        return Arm(robot, self._near)

    def with_friction_model(self, model: FrictionModel | str) -> Arm:
        """The arm with the friction formula of another toolbox release, see :class:`FrictionModel`."""
        if isinstance(model, str):
            names = {known.value: known for known in FrictionModel}
            if model not in names:
                raise UnknownNameError("friction model", model, names, where=self.name)
            model = names[model]
        return Arm(self.robot.with_friction_model(model), self._near)

    # ---- kinematics --------------------------------------------------------------------------------------
    @cached_property
    def fkine(self) -> FrameFunction:
        """``fkine(q)`` → T (4, 4): pose of the tool in the world, lengths in m.

        ``frame=`` the name of another frame in the place of the tool: a named frame of the robot, or a link.
        ``robot.frame_names`` lists them.
        """
        return self._framed_method("fkine")

    @cached_property
    def link_poses(self) -> ConfigurationFunction:
        """``link_poses(q)`` → (L + 2, 4, 4): poses in the world of the base, the L links and the tool."""
        return self._entry("link_poses")

    @cached_property
    def jacob0(self) -> FrameFunction:
        """``jacob0(q)`` → J (6, n): velocity of the tool in world axes is ``J qd``.

        Rows: linear velocity x y z in m/s, then angular velocity x y z in rad/s. ``frame=`` as for ``fkine``.
        """
        return self._framed_method("jacob0")

    @cached_property
    def jacobe(self) -> FrameFunction:
        """``jacobe(q)`` → J (6, n): velocity of the tool in tool axes is ``J qd``, rows as ``jacob0``.

        ``frame=`` as for ``fkine``; the axes are those of the frame.
        """
        return self._framed_method("jacobe")

    @cached_property
    def manipulability(self) -> ConfigurationFunction:
        """``manipulability(q)`` → one number, Yoshikawa's sqrt(det(J J')): 0 at a singularity."""
        return self._entry("manipulability")

    @cached_property
    def integrate(self) -> IntegrateFunction:
        """``integrate(q, qd, dt)`` → q (nq,) after ``dt`` s at constant speeds; quaternions have length 1.

        A ball rotates about a fixed axis by the angle ``|w| dt``; all other coordinates are ``q + qd dt``.
        """
        return self._entry("integrate")

    @cached_property
    def difference(self) -> DifferenceFunction:
        """``difference(q0, q1)`` → qd (n,) with ``integrate(q0, qd, 1) = q1``; balls rotate by at most π."""
        return self._entry("difference")

    @cached_property
    def normalised(self) -> ConfigurationFunction:
        """``normalised(q)`` → q (nq,) with quaternions of length 1."""
        return self._entry("normalised")

    @cached_property
    def position_rates(self) -> StateFunction:
        """``position_rates(q, qd)`` → dq/dt (nq,): ``qd`` itself, and the rates of quaternions."""
        return self._entry("position_rates")

    def assemble(
        self, q: ArrayLike | None = None, qd: ArrayLike | None = None, *, locked: Sequence[str] = ()
    ) -> Assembly:
        """Find the state near ``q`` (nq,), ``qd`` (n,) that satisfies the constraints of the robot.

        By default ``q`` is the neutral configuration and ``qd`` is zero. The joints named in ``locked`` keep
        their coordinates and speeds. Raises :class:`armblocks.errors.AssemblyError` that names the constraint
        with the largest gap if no configuration near ``q`` satisfies all constraints.
        """
        return assemble(self.robot, q, qd, locked)

    def ikine(
        self,
        T: Target,
        q0: ArrayLike | None = None,
        *,
        mask: ArrayLike | None = None,
        limits: bool = True,
        frame: str | None = None,
        axes: str = "tool",
        tolerance: float = 1e-9,
        restarts: int = 100,
        seed: int = 0,
        threads: int = 1,
    ) -> IkineResult:
        """Find coordinates q (nq,) with ``fkine(q) = T`` by iteration, for one pose or for N.

        ``T``: the pose of the tool in the world, m: a :class:`Transform`, (4, 4), (N, 4, 4), a list of
        Transforms, or an SE3 of spatialmath. ``q0`` (nq,) or (N, nq): the first start; the solution has
        the whole turns nearest to it. Without ``q0`` and after a failure, the search starts from ``restarts``
        configurations of a random table, in the order of the distance of their poses from the target.
        ``seed`` selects the table. Results are the same for a pose alone and in any batch.

        ``mask``: six numbers; 0 for a direction in which the pose may differ: x, y, z, then rotations about
        x, y, z, in the ``axes`` of the ``"tool"`` at the target, or of the ``"world"``. An arm with fewer
        than six joints and without a mask reaches only poses that it can reach exactly; the result of other
        poses is the nearest one. ``limits``: whether solutions satisfy the limits of the joints. ``frame``:
        as for ``fkine``. ``tolerance``: the largest error of a solution in m and in rad.

        The result says why there is no solution: :class:`IkineResult`. Method: damped least squares, with
        joints held at their limits (Chan and Lawrence 1988; Sugihara, IEEE T-RO 27, 2011). Raises InputError
        for targets that are not poses, RobotError for robots with closed loops.
        """
        from armblocks.face.ikine import check_axes, checked_options, solve

        where = f"ikine of robot '{self.name}'"
        options = checked_options(mask, limits, tolerance, restarts, seed, where)
        axes = check_axes(axes, where) if mask is not None or axes != "tool" else "world"
        return solve(self._search(frame, axes), T, q0, options, threads)

    def ikine_all(
        self, T: Target, *, limits: bool = True, tolerance: float = 1e-9, threads: int = 1
    ) -> IkineBranches:
        """Find all coordinates q (nq,) with ``fkine(q) = T`` in closed form, for one pose or for N.

        For arms with six joints and a spherical wrist or three parallel axes, arms of parallel axes (SCARA,
        planar), palletisers, and arms with three to five joints of these kinds. The geometry is detected.
        Every branch is checked by forward kinematics to ``tolerance`` (m and rad). ``T`` and ``limits`` as
        for :meth:`ikine`; of angles that differ by whole turns, the one within the limits is given, else
        the one nearest to zero. Raises RobotError that names the reason for other arms.
        """
        return self._closed_form.branches(T, limits, tolerance, threads)

    def ikine6s(
        self, T: Target, configuration: str = "lun", *, limits: bool = False, threads: int = 1
    ) -> IkineResult:
        """Find the solution with the letters of the toolbox's ``ikine6s``, in closed form.

        For arms with six revolute joints, parallel axes 2 and 3, and a spherical wrist. ``l`` or ``r``: left
        or right-handed, ``u`` or ``d``: elbow up or down, ``n`` or ``f``: wrist not flipped or flipped, as in
        release 10 and the Python toolbox. The arm is right-handed if the centre of the wrist is on the side
        of ``z1 × z2`` of axis 1, where z1 and z2 are the directions of axes 1 and 2.
        """
        index = configuration_of(self._closed_form, configuration)
        return chosen_branch(self.robot, self._closed_form.branches(T, limits, 1e-9, threads), index)

    # ---- dynamics ----------------------------------------------------------------------------------------
    @cached_property
    def rne(self) -> MotionFunction:
        """``rne(q, qd, qdd)`` → tau (n,) N m or N: joint torques of a motion, with motors and friction.

        For a motion that violates the constraints of the robot they are NaN.

        ``wrench=`` [fx fy fz mx my mz] in the last link's frame, ``payload=`` a :class:`Payload` at the tool,
        or the mass (kg) of a point mass at the tool.
        """
        return self._loaded_method("rne")

    @cached_property
    def joint_wrenches(self) -> MotionFunction:
        """``joint_wrenches(q, qd, qdd)`` → (L + K, 6): reaction force (N) and moment (N m) of each joint.

        Row k is the wrench that its parent exerts on link k, about the origin and in the axes of the distal
        frame of the joint (NOTATION.md). The component along the axis is the torque of the rigid bodies:
        ``rne`` without friction and rotor inertia. The last K rows are those of the closures of loops: the
        wrench that the first link exerts on the second one, in the second frame. Where equations of closures
        follow from others, their forces are statically indeterminate and are 0 here. ``wrench=`` and
        ``payload=`` as for ``rne``.
        """
        return self._loaded_method("joint_wrenches")

    @cached_property
    def accel(self) -> DrivenStateFunction:
        """``accel(q, qd, tau)`` → qdd (n,) rad/s² or m/s²: accelerations under joint torques and friction."""
        return self._loaded_method("accel")

    @cached_property
    def gravload(self) -> ConfigurationFunction:
        """``gravload(q)`` → (n,) N m or N: torques that hold the arm at rest."""
        return self._entry("gravload")

    @cached_property
    def inertia(self) -> ConfigurationFunction:
        """``inertia(q)`` → M (n, n) kg m² or kg: joint-space mass matrix, motor inertia included."""
        return self._entry("inertia")

    @cached_property
    def coriolis(self) -> StateFunction:
        """``coriolis(q, qd)`` → C (n, n): ``C qd`` are the velocity torques (N m, N); dM/dt - 2 C is skew."""
        return self._entry("coriolis")

    @cached_property
    def friction(self) -> SpeedFunction:
        """``friction(qd)`` → (n,) N m or N: joint torques that overcome friction, a part of ``rne``."""
        return self._entry("friction")

    @cached_property
    def kinetic_energy(self) -> StateFunction:
        """``kinetic_energy(q, qd)`` → energy in J, including the rotors of the motors."""
        return self._entry("kinetic_energy")

    @cached_property
    def potential_energy(self) -> ConfigurationFunction:
        """``potential_energy(q)`` → energy in J, zero if the centre of mass is at the height of the
        origin."""
        return self._entry("potential_energy")

    @cached_property
    def centre_of_mass(self) -> ConfigurationFunction:
        """``centre_of_mass(q)`` → (3,) m: centre of mass of all links, in the world."""
        return self._entry("centre_of_mass")

    def parametric(self, links: Sequence[str]) -> ParametricArm:
        """The dynamics as functions of the masses, centres of mass and inertias of the named ``links``.

        The functions are compiled once for all values, for sweeps, tuning and identification; see
        :class:`ParametricArm`. Raises UnknownNameError for an unknown link.
        """
        return ParametricArm(self.robot, links, self._near, self._description_key)

    # ---- views -------------------------------------------------------------------------------------------
    def plot(
        self,
        q: ArrayLike | None = None,
        *,
        save: str | PathLike[str] | None = None,
        block: bool = False,
        theme: Literal["light", "dark"] | None = None,
        size: tuple[int, int] | None = None,
        view: tuple[float, float] | None = None,
    ) -> Any:
        """Show the arm at ``q`` (nq,), or a motion ``q`` (N, nq), with a slider for each joint.

        In a notebook the result is a widget; elsewhere the 3-D page opens in the browser, and the call
        returns at once. ``block`` waits until the page is closed. The result has ``q``, the coordinates at
        the sliders. ``save``: write a file instead, ``.png``, ``.svg`` or ``.pdf``, and return its path; a
        motion is drawn as its last pose, with the first one pale and the path of the tool. ``theme``: by
        default that of the viewer. ``size``: width and height, px (files, widgets). ``view``: azimuth and
        elevation of the camera of a file, degrees.

        Raises InputError for a wrong shape of ``q``, UnknownNameError for another suffix.
        """
        from armblocks.face import arm_views

        return arm_views.plot(self, q, save=save, block=block, theme=theme, size=size, view=view)

    def animate(
        self,
        q: ArrayLike | JointTrajectory,
        dt: ArrayLike | None = None,
        *,
        save: str | PathLike[str] | None = None,
        rate: float = 25.0,
        speed: float = 1.0,
        block: bool = False,
        theme: Literal["light", "dark"] | None = None,
        size: tuple[int, int] | None = None,
        view: tuple[float, float] | None = None,
        progress: FilmProgress | None = None,
    ) -> Any:
        """Play a motion: ``q`` (N, nq) with ``dt`` s between rows, or at times ``dt`` (N,), or a trajectory.

        As :meth:`plot`, in a notebook or in the browser. The default of ``dt`` is 0.05 s. ``save``: write a
        film instead, ``.mp4`` or ``.gif``, and return its path; ``.png`` and ``.svg`` show the path of the
        tool. Films need the extra ``film``. ``rate``: frames per second. ``speed`` 2 plays twice as fast.
        ``progress(done, all)`` is called after each frame. Ctrl-C leaves an old file unchanged.
        """
        from armblocks.face import arm_views

        appearance: dict[str, Any] = {"theme": theme, "size": size, "view": view}
        film: dict[str, Any] = {"rate": rate, "speed": speed, "progress": progress}
        return arm_views.animate(self, q, dt, save=save, block=block, **appearance, **film)

    def teach(self, q: ArrayLike | None = None, *, block: bool = False) -> Any:
        """Move the joints by sliders, from ``q`` (nq,) on: :meth:`plot` without a motion.

        ``view = arm.teach()``; ``view.q`` are the present coordinates, which can also be set. Robots with
        closed loops stay closed. ``arm.teach(block=True).q`` waits until the page is closed.
        """
        from armblocks.face import arm_views

        return arm_views.teach(self, q, block=block)

    # ---- compilation ---------------------------------------------------------------------------------
    def operation_count(self, method: str) -> OperationCount:
        """Multiplies, adds and other operations in one evaluation of a method, such as ``"rne"``."""
        if method not in _traces():
            raise UnknownNameError("compiled method", method, _traces(), where=self.name)
        return self._kernel(method).count

    @cached_property
    def _description_key(self) -> str:
        """The content on which the equations depend: all except appearance and source file."""
        links = tuple(replace(link, geometry=None) for link in self.robot.links)
        return hashlib.sha256(repr(replace(self.robot, links=links, source="")).encode()).hexdigest()

    def _kernel(self, method: str) -> Kernel:
        kernel = self._kernels.get(method)
        if kernel is None:
            key, options = f"robot/{method}/{self._description_key}", {}
            if self._near is not None and method in _assembled():
                key, options = f"{key}/near {self._near.tolist()}", {"near": self._near}
            kernel = cached_kernel(key, lambda: _traces()[method](self.robot, **options))
            self._kernels[method] = kernel
        return kernel

    def _entry(self, method: str) -> Callable[..., Array]:
        """The native function of a method; pickling stores the robot and the name of the method."""
        kernel = self._kernel(method)
        return kernel.entry_with_fallback(kernel.__call__, maker=self.__reduce__())

    def _framed_method(self, method: str) -> Callable[..., Array]:
        """A function that calls the kernel of a method for the tool, or for another frame of the robot."""
        kernel = self._kernel(method)

        def call(
            *arguments: ArrayLike,
            frame: str | None = None,
            out: Array | None = None,
            threads: int = 1,
            **named: ArrayLike,
        ) -> Array:
            of_frame = kernel if frame is None else self._kernel_at(method, frame)
            if named:
                arguments = in_order(method, kernel.inputs, arguments, named, ("frame", "out", "threads"))
            return (of_frame.entry if named or frame else of_frame)(*arguments, out=out, threads=threads)

        return kernel.entry_with_fallback(call, maker=self.__reduce__())

    def _kernel_at(self, method: str, frame: str) -> Kernel:
        """The kernel of a method for a frame of the robot. Raises UnknownNameError."""
        name = f"{method} of {frame}"
        kernel = self._kernels.get(name)
        if kernel is None:
            self.robot.frame(frame)
            key = f"robot/{name}/{self._description_key}"
            kernel = cached_kernel(key, lambda: _traces()[method](self.robot, frame))
            self._kernels[name] = kernel
        return kernel

    @cached_property
    def _closed_form(self) -> ClosedForm:
        kernel = self._kernel("branches")

        def iterate(targets: Array, starts: Array | None) -> IkineResult:
            return self.ikine(targets, starts, limits=False, restarts=100 if starts is None else 0)

        return ClosedForm.of(self.robot, kernel, iterate)

    def _search(self, frame: str | None, axes: str) -> ArmSearch:
        """The compiled inverse kinematics of the tool or of a frame. Raises UnknownNameError."""
        search = self._searches.get((frame, axes))
        if search is None:
            from armblocks.face.ikine_search import ArmSearch

            name = f"pose_error_in_{axes}"
            error = self._kernel(name) if frame is None else self._kernel_at(name, frame)
            fkine = self._kernel("fkine") if frame is None else self._kernel_at("fkine", frame)
            search = ArmSearch(self.robot, error, fkine, self._kernel("integrate"))
            self._searches[frame, axes] = search
        return search

    def _loaded_method(self, method: str) -> Callable[..., Array]:
        """A function that calls the kernel of a method, or with a wrench or payload a second kernel.

        The second kernel is compiled at its first use.
        """
        kernel = self._kernel(method)

        @cache
        def loaded() -> Callable[..., Array]:
            return self._kernel(f"{method}_loaded").entry

        def call(
            *arguments: ArrayLike,
            wrench: ArrayLike | None = None,
            payload: Payload | ArrayLike | None = None,
            out: Array | None = None,
            threads: int = 1,
            **named: ArrayLike,
        ) -> Array:
            if named:
                arguments = in_order(method, kernel.inputs, arguments, named, _OPTIONS)
            if wrench is None and payload is None:
                return (kernel.entry if named else kernel)(*arguments, out=out, threads=threads)
            force = _NO_WRENCH if wrench is None else wrench
            payload_values = payload.numbers if isinstance(payload, Payload) else payload_numbers(payload)
            try:
                return loaded()(*arguments, force, payload_values, out=out, threads=threads)
            except InputError:
                check_count(
                    method, kernel.inputs, arguments
                )  # the message is about positional arguments only
                raise

        return kernel.entry_with_fallback(call, maker=self.__reduce__())

    def __repr__(self) -> str:
        return f"<Arm {self.name}: {counted(len(self.robot.joints), 'joint')} {self.robot.joint_letters}>"

    def __str__(self) -> str:
        """The text for ``print``: the D-H table, or a table of links and joints."""
        return f"{self!r}\n{kinematics_text(self.robot)}"

    def _repr_html_(self) -> str:
        """The notebook view: a picture of the arm with all joints at zero, and its table."""
        return robot_view(self.robot)


def _assembled() -> Sequence[str]:
    """The methods whose equations depend on an assembled configuration of the robot."""
    from armblocks.dynamics.traces import ASSEMBLED

    return ASSEMBLED


def _traces() -> Mapping[str, Callable[..., TracedFunction]]:
    """All traced quantities; imported here, because code from the disk cache needs no tracing."""
    from armblocks.dynamics import TRACES

    return TRACES
