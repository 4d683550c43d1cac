"""The class ``Arm``: a robot whose equations are traced once and compiled to native code."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler import OperationCount
from armblocks.errors import UnknownNameError, counted
from armblocks.face.arm_kernels import ArmKernels, traces
from armblocks.face.arm_measures import (
    Ellipsoid,
    force_ellipsoid,
    friction_model_of,
    has_spherical_wrist,
    manipulability_of,
    operational_inertia,
    outside_limits,
    perturbed,
    velocity_ellipsoid,
)
from armblocks.face.assembly import Assembly, assemble, coordinates
from armblocks.face.forward_simulation import ArmMotionResult, TorqueLaw, simulate_arm
from armblocks.face.ikine_branches import IkineBranches
from armblocks.face.ikine_result import IkineResult
from armblocks.face.native_functions import NativeFunctions
from armblocks.face.parametric import ParametricArm
from armblocks.robot import Configurations, FrictionModel, Link, Robot
from armblocks.robot.dh_table import configuration_lines, kinematics_text
from armblocks.robot.fields import check_kind

if TYPE_CHECKING:
    from armblocks.face.arm_inverse import ArmInverse
    from armblocks.face.ikine_targets import Target
    from armblocks.face.symbolic_arm import SymbolicArm
    from armblocks.face.trajectory import JointTrajectory
    from armblocks.pictures.film import FilmProgress

Array = NDArray[np.float64]


class Arm(NativeFunctions):
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

    ``robot``: a robot, or another arm, whose robot is used. ``near`` (nq,): coordinates of a robot with
    closed loops near which its constraints can be assembled. At this configuration, ``accel``, ``rne`` and
    ``gravload`` determine the independent equations of the loops. By default they search near the neutral
    configuration, then within the ranges of the joints.

    Units are SI: rad or m, N m or N. Frames: world, unless stated otherwise.
    """

    def __init__(self, robot: Robot | Arm, near: ArrayLike | None = None) -> None:
        robot = robot.robot if isinstance(robot, Arm) else robot
        check_kind(robot, Robot, where="Arm")
        self.robot = robot
        self._near = None if near is None else coordinates(robot, "near", near, robot.nq)
        self._code = ArmKernels(robot, self._near, self.__reduce__())

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

    @property
    def q(self) -> Configurations:
        """The named configurations: ``arm.fkine(arm.q["ready"])``. Each access is a new array (nq,)."""
        return self.robot.configurations

    def with_configuration(self, name: str, q: ArrayLike) -> Arm:
        """The arm with the named configuration ``q`` (nq,), rad or m, which replaces one of this name.

        ``arm.robot`` has it for files. Raises RobotError for another number of coordinates and for NaN.
        """
        return Arm(self.robot.with_configuration(name, q), self._near)

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

    def perturb(self, amount: float = 0.1, *, seed: int = 0) -> Arm:
        """The arm with each mass and inertia scaled by ``1 ± amount`` at random, for tests of controllers."""
        return Arm(perturbed(self.robot, amount, seed), self._near)

    def with_friction_model(self, model: FrictionModel | str) -> Arm:
        """The arm with the friction formula of another toolbox release, see :class:`FrictionModel`."""
        return Arm(self.robot.with_friction_model(friction_model_of(model, self.name)), self._near)

    # ---- kinematics --------------------------------------------------------------------------------------
    def maniplty(self, q: ArrayLike, kind: str = "yoshikawa", axes: str = "all") -> Array:
        """A measure of the mobility of the tool at ``q`` (nq,) or (N, nq); 0 at a singularity.

        - ``kind``: ``"yoshikawa"`` is the product of the singular values of the Jacobian, ``"asada"`` the
          smallest over the largest eigenvalue of ``cinertia``, ``"condition"`` the smallest over the largest
          singular value, and ``"smallest"`` the smallest singular value.
        - ``axes``: ``"all"``, ``"trans"`` or ``"rot"``. The units of ``"all"`` are mixed.
        """
        return manipulability_of(self.jacob0, self.inertia, q, kind, axes, f"maniplty of robot '{self.name}'")

    def velocity_ellipsoid(self, q: ArrayLike, axes: str = "trans") -> Ellipsoid:
        """The velocities of the tool, m/s or rad/s (``"rot"``), for joint speeds ``|qd| = 1``."""
        return velocity_ellipsoid(self.jacob0(q), axes, f"velocity_ellipsoid of robot '{self.name}'")

    def force_ellipsoid(self, q: ArrayLike, axes: str = "trans") -> Ellipsoid:
        """The forces, N or N m (``"rot"``), that joint torques ``|tau| = 1`` balance without other loads."""
        return force_ellipsoid(self.jacob0(q), axes, f"force_ellipsoid of robot '{self.name}'")

    def __iter__(self) -> Iterator[Link]:
        """The links with a joint that moves, in the order of q."""
        return iter(self.robot.moving_links)

    def islimit(self, q: ArrayLike) -> NDArray[np.bool_]:
        """For each coordinate of ``q`` (nq,) or (N, nq) whether it is outside the limits of its joint."""
        return outside_limits(self.robot, q)

    def isspherical(self) -> bool:
        """Whether the arm has a spherical wrist: its last three axes are revolute and meet in a point."""
        return has_spherical_wrist(self.robot)

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

        - ``T``: the pose of the tool in the world, m: a :class:`Transform`, (4, 4), (N, 4, 4), a list of
          Transforms, or an SE3 of spatialmath.
        - ``q0`` (nq,) or (N, nq): the first start; angles of the solution are shifted by full turns to the
          values nearest to ``q0``.
        - ``restarts``, ``seed``: without ``q0`` and after a failure, the search starts from ``restarts``
          configurations of a random table, in the order of the distance of their poses from the target.
          ``seed`` selects the table.
        - ``mask``: six numbers; 0 for a direction in which the pose may differ: x, y, z, then rotations about
          x, y, z, in the ``axes`` of the ``"tool"`` at the target, or of the ``"world"``. Without a mask, an
          arm with fewer than six joints has solutions only for poses whose six components it reaches; for
          other poses the result is the nearest pose.
        - ``limits``: whether solutions satisfy the limits of the joints.
        - ``frame``: as for ``fkine``.
        - ``tolerance``: the largest error of a solution in m and in rad.

        The result of a pose is identical alone and in any batch. If there is no solution, the result states
        the reason: :class:`IkineResult`. Method: damped least squares with an active set of joint limits
        (Chan and Lawrence 1988; Sugihara, IEEE T-RO 27, 2011). For closed loops, pose and constraints are
        solved together. Raises InputError for targets that are not poses.
        """
        return self._inverse.call(mask, limits, frame, axes, tolerance, restarts, seed)(T, q0, threads)

    def ikine_all(
        self,
        T: Target,
        *,
        limits: bool = True,
        frame: str | None = None,
        tolerance: float = 1e-9,
        threads: int = 1,
    ) -> IkineBranches:
        """Find all coordinates q (nq,) with ``fkine(q) = T`` in closed form, for one pose or for N.

        The closed form exists for arms with six joints and a spherical wrist or three parallel axes, for arms
        with only parallel axes (SCARA, planar), and for palletisers. It also exists for arms of these types
        with three to five joints.

        - ``T``, ``limits``: as for :meth:`ikine`. Angles are shifted by full turns into the limits if
          possible, else to the value nearest to zero.
        - ``frame``: a frame that is fixed to the link of the tool.
        - ``tolerance``: every branch is checked by forward kinematics to this error of the tool, m and rad.

        Raises RobotError with the reason for other arms.
        """
        return self._inverse.branches(T, limits, frame, tolerance, threads)

    def ikine6s(
        self, T: Target, configuration: str = "lun", *, limits: bool = False, threads: int = 1
    ) -> IkineResult:
        """Find the solution with the letters of the toolbox's ``ikine6s``, in closed form.

        For arms with six revolute joints, parallel axes 2 and 3, and a spherical wrist. The letters of
        ``configuration`` are those of release 10 and of the Python toolbox:

        - ``l`` or ``r``: left or right-handed. The arm is right-handed if the centre of the wrist is on the
          side of ``z1 × z2`` of axis 1, where z1 and z2 are the directions of axes 1 and 2.
        - ``u`` or ``d``: elbow up or down.
        - ``n`` or ``f``: wrist not flipped or flipped.
        """
        return self._inverse.with_letters(T, configuration, limits, threads)

    # ---- dynamics ----------------------------------------------------------------------------------------
    def fdyn(
        self,
        duration: float,
        torque: TorqueLaw | ArrayLike | None = None,
        q0: ArrayLike | None = None,
        qd0: ArrayLike | None = None,
        *,
        sample_time: float | None = None,
        dt: float = 0.01,
        **settings: Any,
    ) -> ArmMotionResult:
        """Simulate ``duration`` s from ``q0``, ``qd0`` under joint torques; ``t, q, qd = arm.fdyn(2.0)``.

        - ``torque``: none, (n,) constant, or a function with any of the arguments ``t, q, qd``. The function
          is traced and compiled (:class:`PythonFunction`).
        - ``sample_time`` (s): the function is called at each tick instead, and may then branch on values.
        - ``dt``: interval of the samples, s.
        - ``settings``: of ``ab.simulate``.

        Joints with Coulomb friction can stick.
        """
        return simulate_arm(self.robot, duration, torque, q0, qd0, sample_time, dt, settings)

    def cinertia(self, q: ArrayLike) -> Array:
        """The inertia at the tool in world axes (6, 6), ``(J M⁻¹ J')⁻¹``; NaN at singularities."""
        return operational_inertia(self.jacob0, self.inertia, q)

    def parametric(self, links: Sequence[str]) -> ParametricArm:
        """The dynamics as functions of the masses, centres of mass and inertias of the named ``links``.

        The functions are compiled once for all values, for sweeps, tuning and identification; see
        :class:`ParametricArm`. Raises UnknownNameError for an unknown link.
        """
        return ParametricArm(self.robot, links, self._near, self._code.description_key)

    @property
    def symbolic(self) -> SymbolicArm:
        """Kinematics and dynamics in symbols: CasADi, SymPy, text and LaTeX; see :class:`SymbolicArm`."""
        return self._code.symbolic

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

        In a notebook the result is a widget. Elsewhere the 3-D page opens in the browser, and the call
        returns at once. The attribute ``q`` of the result has the coordinates at the sliders.

        - ``q``: rad or m; by default the neutral configuration.
        - ``save``: write a file instead, ``.png``, ``.svg`` or ``.pdf``, and return its path. A motion is
          drawn as its last pose, its first pose (pale) and the path of the tool.
        - ``block``: wait until the page is closed.
        - ``theme``: ``"light"``, ``"dark"``, or by default the theme of the viewer.
        - ``size``: width and height, px, of files and widgets.
        - ``view``: azimuth and elevation of the camera of a file, degrees.

        Raises InputError for a wrong shape of ``q``, UnknownNameError for an unsupported suffix.
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
        """Play a motion as a widget in a notebook, else on a browser page, as for :meth:`plot`.

        - ``q``: coordinates (N, nq), rad or m, or a trajectory.
        - ``dt``: the time between rows, s, by default 0.05; or the times (N,) of the rows. By default a
          trajectory has its own times.
        - ``save``: write a video instead, ``.mp4`` or ``.gif``, and return its path. ``.png``, ``.svg`` and
          ``.pdf`` show the path of the tool. Videos need the extra ``film``.
        - ``rate``: frames per second of a video.
        - ``speed``: 2 plays the video twice as fast.
        - ``block``, ``theme``, ``size``, ``view``: as for :meth:`plot`.
        - ``progress(done, all)`` is called after each frame. Ctrl-C leaves an existing file unchanged.
        """
        from armblocks.face import arm_views

        appearance: dict[str, Any] = {"theme": theme, "size": size, "view": view}
        film: dict[str, Any] = {"rate": rate, "speed": speed, "progress": progress}
        return arm_views.animate(self, q, dt, save=save, block=block, **appearance, **film)

    def teach(self, q: ArrayLike | None = None, *, block: bool = False) -> Any:
        """Show the arm at ``q`` (nq,) with a slider for each joint, as :meth:`plot` without a motion.

        ``view = arm.teach()``; ``view.q`` are the present coordinates, which can also be set. Closed loops
        stay closed. ``arm.teach(block=True).q`` waits until the page is closed.
        """
        from armblocks.face import arm_views

        return arm_views.teach(self, q, block=block)

    # ---- compilation ---------------------------------------------------------------------------------
    def operation_count(self, method: str) -> OperationCount:
        """Multiplies, adds and other operations in one evaluation of a method, such as ``"rne"``."""
        if method not in traces():
            raise UnknownNameError("compiled method", method, traces(), where=self.name)
        return self._code.kernel(method).count

    @cached_property
    def _inverse(self) -> ArmInverse:
        from armblocks.face.arm_inverse import ArmInverse

        return ArmInverse(self._code)

    def __repr__(self) -> str:
        return f"<Arm {self.name}: {counted(len(self.robot.joints), 'joint')} {self.robot.joint_letters}>"

    def __str__(self) -> str:
        """The text for ``print``: the D-H table, or a table of links and joints; named configurations."""
        return "\n".join([repr(self), kinematics_text(self.robot), *configuration_lines(self.robot)])

    def _repr_html_(self) -> str:
        """The notebook view: a picture of the arm with all joints at zero, and its table."""
        from armblocks.face.notebook_views import robot_view

        return robot_view(self.robot)
