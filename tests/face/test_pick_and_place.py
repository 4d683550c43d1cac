"""Cycles of picking and placing: poses, vertical lines, pauses, limits in each phase, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.errors import InputError

Q0 = [0, 0.8, -2.4, 0, 0.4, 0]
TORQUE = np.array([80.0, 140, 80, 20, 20, 20])
LIMITS: dict[str, Any] = {"speed": 2.5, "acceleration": 20.0, "torque": TORQUE}


def pose(x: float, y: float, z: float) -> np.ndarray:
    """A pose (4, 4) at a position in m whose tool points down."""
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[:3, 3] = x, y, z
    return T


def test_a_cycle_reaches_its_poses_on_vertical_lines_within_the_limits() -> None:
    arm = ab.load_robot("puma560")
    pick, place = pose(0.5, -0.3, 0.4), pose(0.5, 0.3, 0.5)
    cycle = ab.pick_and_place(arm, Q0, pick, place, lift=0.1, grip_time=0.3, payload=2.0, **LIMITS)
    names = [phase.name for phase in cycle.phases]
    assert names == ["approach", "grip", "transfer", "release", "retract"]
    assert [phase.loaded for phase in cycle.phases] == [False, True, True, False, False]
    starts, ends = ([getattr(phase, side) for phase in cycle.phases] for side in ("start", "end"))
    assert starts[0] == 0.0 and starts[1:] == ends[:-1] and ends[-1] == pytest.approx(cycle.cycle_time)
    approach, grip, transfer, release, _ = cycle.phases
    for phase, expected in ((grip, pick), (release, place)):
        assert phase.end - phase.start == pytest.approx(0.3)
        held = cycle.trajectory(np.linspace(phase.start + 1e-6, phase.end - 1e-6, 5))
        assert_allclose(arm.fkine(held.q), [expected] * 5, atol=1e-8)
        assert_allclose(held.qd, 0.0, atol=1e-9)
    assert_allclose(cycle.trajectory.q[[0, -1]], [Q0, Q0], atol=1e-12)
    for phase, target, side in ((approach, pick, -1), (transfer, pick, 1), (transfer, place, -1)):
        end = phase.end if side < 0 else phase.start
        tool = arm.fkine(cycle.trajectory(end + side * np.linspace(0.0, 0.1, 30)).q)[:, :3, 3]
        near = tool[tool[:, 2] < target[2, 3] + 0.05]
        assert len(near) > 3
        assert np.abs(near[:, :2] - target[:2, 3]).max() < 1e-3
    for phase in cycle.phases:
        q, qd, qdd = cycle.trajectory(np.linspace(phase.start + 1e-6, phase.end - 1e-6, 400))
        tau = arm.rne(q, qd, qdd, payload=2.0 if phase.loaded else 0.0)
        assert (np.abs(tau) / TORQUE).max() < 1.005
        assert np.abs(qd).max() < 2.5 * 1.001 and np.abs(qdd).max() < 20.0 * 1.005
    assert "transfer, loaded" in str(cycle) and "cycle time" in str(cycle)


def test_reports_of_a_cycle_have_the_payload_in_its_loaded_phases_only() -> None:
    arm = ab.load_robot("puma560")
    cycle = ab.pick_and_place(arm, Q0, pose(0.5, -0.3, 0.4), pose(0.5, 0.3, 0.5), payload=6.0, **LIMITS)
    report = ab.trajectory_report(arm, cycle, payload=6.0, **LIMITS)
    moving = np.abs(report.qd).max(axis=1) > 1e-9  # at rest, rounding errors decide the sign of friction
    assert report.ratios[moving].max() < 1.005
    always = ab.trajectory_report(arm, cycle.trajectory, payload=6.0, **LIMITS)
    assert always.ratios[np.abs(always.qd).max(axis=1) > 1e-9].max() > 1.05
    retract = cycle.phases[-1]
    empty = (report.time > retract.start + 1e-6) & (report.time < retract.end)
    motion = report.q[empty], report.qd[empty], report.qdd[empty]
    assert_allclose(report.tau[empty], arm.rne(*motion), rtol=1e-12, atol=1e-9)
    loaded = (report.time > cycle.phases[1].start) & (report.time < cycle.phases[2].end)
    motion = report.q[loaded], report.qd[loaded], report.qdd[loaded]
    assert_allclose(report.tau[loaded], arm.rne(*motion, payload=6.0), rtol=1e-12)
    none = ab.trajectory_report(arm, cycle, **LIMITS)
    assert_allclose(none.tau, arm.rne(none.q, none.qd, none.qdd), rtol=1e-12)
    drive = ab.Drive(name="a", gear_ratio=100.0, stall_torque=5.0, max_speed=500.0)
    phases, whole = (
        ab.size_drives(arm, motion, [drive], payload=6.0) for motion in (cycle, cycle.trajectory)
    )
    assert phases.cycle_time == whole.cycle_time
    pairs = list(zip(phases.loads, whole.loads))
    assert all(one.holding_torque <= two.holding_torque * (1 + 1e-12) for one, two in pairs)
    assert all(one.rms_torque < two.rms_torque for one, two in pairs[1:3])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"pick": pose(1.5, 0.0, 0.4)},
            r"pick_and_place, pick: the arm does not reach the tool position \(1.5",
        ),
        ({"place": np.eye(3)}, "pick_and_place: place is not a pose"),
        ({"lift": 0.0}, "lift = 0.0.*above 0, in m"),
        ({"q0": [0.0, 0.0]}, "q0 has 2 joints.*6, the number of joints of the robot"),
        ({"blend": 0.9}, "blend = 0.9"),
    ],
)
def test_cycles_that_cannot_be_planned_are_refused(change: dict[str, Any], message: str) -> None:
    arguments = {"q0": Q0, "pick": pose(0.5, -0.3, 0.4), "place": pose(0.5, 0.3, 0.5), **LIMITS, **change}
    with pytest.raises(InputError, match=message):
        ab.pick_and_place(ab.load_robot("puma560"), **arguments)


def test_a_change_of_the_configuration_on_a_line_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    arm, solve = ab.load_robot("puma560"), ab.Arm.ikine

    def jumping(self: ab.Arm, T: Any, q0: Any = None, **options: Any) -> ab.IkineResult:
        result = solve(self, T, q0, **options)
        if T[2, 3] < 0.45:
            result.q[3] += 2.0
        return result

    monkeypatch.setattr(ab.Arm, "ikine", jumping)
    with pytest.raises(InputError, match="a joint jumps by 2 on the vertical line"):
        ab.pick_and_place(arm, Q0, pose(0.5, -0.3, 0.4), pose(0.5, 0.3, 0.5), **LIMITS)
