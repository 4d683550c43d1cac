"""A joint with a motion input: some or all of its coordinates are a signal, and its drive has any torque.

The speeds and accelerations of these coordinates are the exact derivatives of the signal. They have no
states. The mechanism computes the torque of the drive (:mod:`armblocks.dynamics.drawn_drives`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from casadi import SX, vertcat

from armblocks.diagram import Port, Shapes, Signals, State
from armblocks.dynamics.ball_joints import speeds_of_rates
from armblocks.dynamics.joint_motion import entries
from armblocks.multibody.joint_states import JointStates, motion_ports, shape_of_speeds
from armblocks.multibody.parts import JointPart
from armblocks.robot.joints import AxisMotion, Motion


def motion_name(motion: Motion) -> str:
    """The name of an elementary motion in the parameter ``moved`` of a joint."""
    return motion.name if isinstance(motion, AxisMotion) else "rotation"


def motion_input_port(part: JointPart) -> Port:
    """The input for the coordinates that are given: of all of them, or of the chosen ones."""
    chosen = part.driven_positions()
    positions = [entry for motion in part.motions for entry in motion.positions]
    units = {positions[k].unit for k in chosen}
    names = tuple(positions[k].name for k in chosen) if part.nq > 1 else ()
    doc = "given coordinates: follower relative to base"
    return Port("motion", doc, units.pop() if len(units) == 1 else "", (len(names),) if names else (), names)


@dataclass(frozen=True, kw_only=True)
class DrivenJointStates(JointStates):
    """The states of a joint with a motion input: only the coordinates that are not given have states."""

    title: ClassVar[str] = "Driven joint"
    differentiated_inputs: ClassVar[tuple[str, ...]] = ("motion", "motion'")

    # -- ports and states

    def input_ports(self) -> tuple[Port, ...]:
        drive = Port(
            "mechanism drive", "forces that the motion needs", "", shape_of_speeds(self.place), internal=True
        )
        return (*super().input_ports(), drive)

    def output_ports(self) -> tuple[Port, ...]:
        given = Port("given qdd", "given accelerations", "", shape_of_speeds(self.place), internal=True)
        return (*super().output_ports(), given)

    def _free(self) -> tuple[list[int], list[int]]:
        """The indices of the coordinates and speeds that have states."""
        part = self.place
        positions, speeds = part.driven_positions(), part.driven_speeds()
        return (
            [k for k in range(part.nq) if k not in positions],
            [k for k in range(part.nv) if k not in speeds],
        )

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        q, qd, _ = motion_ports(self.place)
        positions, speeds = self._free()
        if not speeds:
            return ()
        return (
            State("q", (len(positions),), q.doc, q.unit),
            State("qd", (len(speeds),), qd.doc, qd.unit),
        )

    def initial_states(self, p: Signals) -> Signals:
        positions, speeds = self._free()
        if not speeds:
            return {}
        start = super().initial_states(p)
        return {"q": start["q"][positions], "qd": start["qd"][speeds]}

    # -- equations

    def state_of(self, x: Signals, u: Signals) -> tuple[SX, SX]:
        q, qd, _ = self._motion(x, u)
        return q, qd

    def _motion(self, x: Signals, u: Signals) -> tuple[SX, SX, SX]:
        """Coordinates, speeds and accelerations; the accelerations that are not given are 0."""
        part = self.place
        driven, speeds = part.driven_positions(), part.driven_speeds()
        neutral = [value for motion in part.motions for value in motion.neutral]
        q, rates, second_rates = SX(neutral), SX.zeros(part.nq), SX.zeros(part.nq)
        q[driven], rates[driven], second_rates[driven] = u["motion"], u["motion'"], u["motion''"]
        of_rates = speeds_of_rates(part.motions, entries(q), entries(rates), entries(second_rates))
        given_qd, given_qdd = (SX(vertcat(*column)) for column in of_rates)
        qd, qdd = SX.zeros(part.nv), SX.zeros(part.nv)
        qd[speeds], qdd[speeds] = given_qd[speeds], given_qdd[speeds]
        free_positions, free_speeds = self._free()
        if free_speeds:
            q[free_positions], qd[free_speeds] = x["q"], x["qd"]
        return q, qd, qdd

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        values = dict(super().outputs(t, x, u, p))
        values["given qdd"] = self._motion(x, u)[2]
        if "actuator" in values:
            speeds = self.place.driven_speeds()
            internal = values["generalised force"] - values["actuator"]
            actuator = SX(values["actuator"])
            actuator[speeds] = (u["mechanism drive"] - internal)[speeds]
            values["actuator"] = actuator
        return values

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        positions, speeds = self._free()
        if not speeds:
            return {}
        q, qd, _ = self._motion(x, u)
        rates = super().derivatives(t, {"q": q, "qd": qd}, u, p)
        return {"q": rates["q"][positions], "qd": rates["qd"][speeds]}
