"""The kinematics and dynamics of an arm as native functions, compiled at their first access."""

from __future__ import annotations

from functools import cached_property
from typing import cast

from armblocks.argument_errors import ArgumentErrors
from armblocks.face.arm_functions import (
    ConfigurationFunction,
    DifferenceFunction,
    DrivenStateFunction,
    FramedStateFunction,
    FrameFunction,
    HybridFunction,
    IntegrateFunction,
    MotionFunction,
    SpeedFunction,
    StateFunction,
)
from armblocks.face.arm_kernels import ArmKernels


class NativeFunctions(metaclass=ArgumentErrors):
    """Base class of :class:`armblocks.Arm`: functions of the coordinates, speeds and torques of its joints.

    Each property is a callable object, whose type in :mod:`armblocks.face.arm_functions` has the signature.
    """

    _code: ArmKernels

    # ---- kinematics --------------------------------------------------------------------------------------
    @cached_property
    def fkine(self) -> FrameFunction:
        """``fkine(q)`` → T (4, 4): pose of the tool in the world, lengths in m.

        ``frame=``: the name of a frame instead of the tool: a named frame of the robot, or a link.
        ``robot.frame_names`` lists the names.
        """
        return self._code.framed("fkine")

    @cached_property
    def link_poses(self) -> ConfigurationFunction:
        """``link_poses(q)`` → (L + 2, 4, 4): poses in the world of the base, the L links and the tool."""
        return self._code.entry("link_poses")

    @cached_property
    def jacob0(self) -> FrameFunction:
        """``jacob0(q)`` → J (6, n): velocity of the tool in world axes is ``J qd``.

        Rows: linear velocity x y z in m/s, then angular velocity x y z in rad/s. ``frame=`` as for ``fkine``.
        """
        return self._code.framed("jacob0")

    @cached_property
    def jacobe(self) -> FrameFunction:
        """``jacobe(q)`` → J (6, n): velocity of the tool in tool axes is ``J qd``, rows as ``jacob0``.

        ``frame=`` as for ``fkine``; the velocity is then in axes of the frame.
        """
        return self._code.framed("jacobe")

    @cached_property
    def jacob0_dot(self) -> FramedStateFunction:
        """``jacob0_dot(q, qd)`` → dJ/dt (6, n): the time derivative of ``jacob0``."""
        return self._code.framed("jacob0_dot")

    @cached_property
    def jacob_dot(self) -> FramedStateFunction:
        """``jacob_dot(q, qd)`` → dJ/dt qd (6,): acceleration of the tool for ``qdd = 0``, m/s² and rad/s²."""
        return self._code.framed("jacob_dot")

    @cached_property
    def hessian0(self) -> FrameFunction:
        """``hessian0(q)`` → H (n, 6, n): derivatives ``H[k]`` of ``jacob0`` for unit speeds ``qd[k]``."""
        return self._code.framed("hessian0")

    @cached_property
    def manipulability(self) -> ConfigurationFunction:
        """``manipulability(q)`` → one number, Yoshikawa's measure: 0 at a singularity.

        It is the product of the singular values of ``jacob0``: sqrt(det(J J')), or sqrt(det(J' J)) for fewer
        than six degrees of freedom.
        """
        return self._code.entry("manipulability")

    @cached_property
    def integrate(self) -> IntegrateFunction:
        """``integrate(q, qd, dt)`` → q (nq,) after ``dt`` s at constant speeds; quaternions have length 1.
        A ball rotates about a fixed axis by the angle ``|w| dt``; all other coordinates are ``q + qd dt``.
        """
        return self._code.entry("integrate")

    @cached_property
    def difference(self) -> DifferenceFunction:
        """``difference(q0, q1)`` → qd (n,) with ``integrate(q0, qd, 1) = q1``; balls rotate by at most π."""
        return self._code.entry("difference")

    @cached_property
    def normalised(self) -> ConfigurationFunction:
        """``normalised(q)`` → q (nq,) with quaternions of length 1."""
        return self._code.entry("normalised")

    @cached_property
    def position_rates(self) -> StateFunction:
        """``position_rates(q, qd)`` → dq/dt (nq,): ``qd`` itself, and the rates of quaternions."""
        return self._code.entry("position_rates")

    # ---- dynamics ----------------------------------------------------------------------------------------
    @cached_property
    def rne(self) -> MotionFunction:
        """``rne(q, qd, qdd)`` → tau (n,) N m or N: joint torques of a motion, with motors and friction.

        - ``wrench=``: [fx fy fz mx my mz], N and N m, that the tip exerts on its surroundings, in the
          last link's frame.
        - ``payload=``: a :class:`Payload` at the tool, or a point mass (kg).

        The torques of a motion that violates the constraints of the robot are NaN.
        """
        return self._code.loaded("rne")

    @cached_property
    def joint_wrenches(self) -> MotionFunction:
        """``joint_wrenches(q, qd, qdd)`` → (L + K, 6): reaction force (N) and moment (N m) of each joint.

        - Row k of the first L rows is the wrench that its parent exerts on link k, about the origin and in
          the axes of the distal frame of the joint, the joint frame that is fixed to the link. The component
          along the axis is the torque of the rigid bodies: ``rne`` without friction and rotor inertia.
        - The last K rows are the wrenches of the closures of loops, which the first link exerts on the second
          link, in the second frame. Forces of redundant closure equations are statically indeterminate and
          are 0 in the result.

        ``wrench=`` and ``payload=`` as for ``rne``.
        """
        return self._code.loaded("joint_wrenches")

    @cached_property
    def accel(self) -> DrivenStateFunction:
        """``accel(q, qd, tau)`` → qdd (n,) rad/s² or m/s²: accelerations under joint torques and friction."""
        return self._code.loaded("accel")

    @cached_property
    def hybrid_dynamics(self) -> HybridFunction:
        """``hybrid_dynamics(q, qd, tau, qdd)`` → (qdd, tau), each (n,): motion with prescribed joints.

        - ``qdd``: accelerations of the joints of the robot's :class:`PrescribedMotion` constraints, rad/s² or
          m/s². Its other entries are not read.
        - ``tau``: torques of all other joints, N m or N. Its other entries are not read.
        - ``wrench=``, ``payload=``: as for ``rne``.

        The results are the accelerations and the torques of all joints, including the drives of the
        prescribed joints. In closed loops the state is the consistent state nearest to ``q``, ``qd`` with the
        given motion of these joints; the results are NaN if this state is too far away.

        Raises MissingFunctionError without prescribed joints, and RobotError if their motions depend on each
        other.
        """
        return cast("HybridFunction", self._code.loaded("hybrid_dynamics"))

    @cached_property
    def gravload(self) -> ConfigurationFunction:
        """``gravload(q)`` → (n,) N m or N: torques that hold the arm at rest."""
        return self._code.entry("gravload")

    @cached_property
    def inertia(self) -> ConfigurationFunction:
        """``inertia(q)`` → M (n, n) kg m² or kg: joint-space mass matrix, motor inertia included."""
        return self._code.entry("inertia")

    @cached_property
    def coriolis(self) -> StateFunction:
        """``coriolis(q, qd)`` → C (n, n): ``C qd`` are the velocity torques (N m, N); dM/dt - 2 C is skew."""
        return self._code.entry("coriolis")

    @cached_property
    def friction(self) -> SpeedFunction:
        """``friction(qd)`` → (n,) N m or N: joint torques that overcome friction, a part of ``rne``."""
        return self._code.entry("friction")

    @cached_property
    def kinetic_energy(self) -> StateFunction:
        """``kinetic_energy(q, qd)`` → energy in J, including the rotors of the motors."""
        return self._code.entry("kinetic_energy")

    @cached_property
    def potential_energy(self) -> ConfigurationFunction:
        """``potential_energy(q)`` → energy in J, of gravity and springs.

        The energy of gravity is zero with the centre of mass at the height of the world's origin.
        """
        return self._code.entry("potential_energy")

    @cached_property
    def centre_of_mass(self) -> ConfigurationFunction:
        """``centre_of_mass(q)`` → (3,) m: centre of mass of all links, in the world."""
        return self._code.entry("centre_of_mass")
