"""The catalogue of published arms: laws of every robot, and motions from sources that share no code."""

from __future__ import annotations

import json
import math
import runpy
from pathlib import Path

import casadi
import numpy as np
import pytest

from armblocks.dynamics import trace_accel, trace_fkine, trace_inertia, trace_jacob0, trace_rne
from armblocks.equations import TracedFunction
from armblocks.formats import list_robots, load_robot
from armblocks.formats.robot_facts import MassOrigin, shipped_facts, shipped_summary
from armblocks.robot import Robot, inertia_findings
from armblocks.robot.geometry import link_frames
from robots_for_tests import evaluate

ESTIMATES = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "estimated_masses.py"))
PALLETISERS = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "palletisers.py"))["ARMS"]
MOTIONS = json.loads((Path(__file__).parent / "catalogue_motions.json").read_text(encoding="utf-8"))
PANDA = json.loads((Path(__file__).parent / "panda_dynamics.json").read_text(encoding="utf-8"))
EXERCISES = {"kr180", "kr180_cell", "planar3r", "puma560", "twolink"}
"""Robots of the paper and of exercises, which are not part of the catalogue."""
CATALOGUE = sorted(set(list_robots()) - EXERCISES)
ESTIMATED = [name for name in CATALOGUE if shipped_facts(name).masses is MassOrigin.ESTIMATED]
NOT_COMPARED = {"phantomx", "puma560_akb", "stanford"}
"""Robots for which no second source is known."""


def function(traced: TracedFunction) -> casadi.Function:
    return traced.casadi_function()


def tool_pose(robot: Robot, q: np.ndarray) -> np.ndarray:
    return link_frames(robot, q.tolist())[-1]


def sample(robot: Robot, seed: int) -> np.ndarray:
    """A configuration within the ranges, and within a turn of joints without range."""
    low, high = np.clip(robot.qlim, -math.pi, math.pi).T
    return np.random.default_rng(seed).uniform(low, high)


def test_the_catalogue_has_more_than_fifty_arms_with_sources() -> None:
    assert len(CATALOGUE) >= 50
    for name in CATALOGUE:
        facts = shipped_facts(name)
        assert facts.sources and facts.licence and facts.masses is not None, name
        assert ("estimated" in facts.notes) == (facts.masses is MassOrigin.ESTIMATED) or name == "stanford", (
            name
        )
        convention = "parallelogram linkage" if name in PALLETISERS else "D-H rows"
        assert convention in facts.notes, f"{name}: the notes state the convention"


@pytest.mark.parametrize("name", list_robots())
def test_the_summary_of_a_robot_is_that_of_the_loaded_robot(name: str) -> None:
    robot, summary = load_robot(name), shipped_summary(name)
    assert (summary.title, summary.manufacturer) == (robot.name, robot.manufacturer)
    assert (summary.comment, summary.joint_letters) == (robot.comment, robot.joint_letters)


@pytest.mark.parametrize("name", MOTIONS)
def test_the_tool_moves_as_in_the_second_source(name: str) -> None:
    """T(q) T(0)^-1, which depends neither on the tool frame nor on the zero pose."""
    robot, source = load_robot(name), MOTIONS[name]
    start = np.linalg.inv(tool_pose(robot, np.zeros(robot.n)))
    for entry in source["motions"]:
        motion = tool_pose(robot, np.array(entry["q"])) @ start
        np.testing.assert_allclose(
            motion[:3], entry["motion"], rtol=0, atol=source["tolerance"], err_msg=source["source"]
        )


def test_every_arm_is_compared_with_a_second_source() -> None:
    assert set(MOTIONS) | NOT_COMPARED | {"m410ic_185"} == set(CATALOGUE)


def test_the_panda_has_the_torques_of_the_program_of_its_authors() -> None:
    """Gravity torques and inertia matrices of the published MATLAB program, which has no link parameters.

    The link parameters of the paper reproduce them approximately: 0.15 N m and 0.04 kg m2.
    """
    panda = load_robot("panda")
    for entry in PANDA["states"]:
        q = np.array(entry["q"])
        np.testing.assert_allclose(evaluate(panda, "gravload", q), entry["gravload"], rtol=0, atol=0.15)
        np.testing.assert_allclose(evaluate(panda, "inertia", q), entry["inertia"], rtol=0, atol=0.04)


def test_the_palletiser_of_fanuc_has_the_envelope_of_its_data_sheet() -> None:
    """Heights of the faceplate: 2.397 m (J2 = 0, J3 = 10 deg), -0.561 m (100, -90); J3 is absolute."""
    robot = load_robot("m410ic_185")
    for forward, up, height in ((0, 10, 2.397), (100, -90, -0.561)):
        pose = tool_pose(robot, np.radians([0, forward, up, 0]))
        assert pose[2, 3] == pytest.approx(height, abs=1e-3)
        np.testing.assert_allclose(pose[:3, 2], [0, 0, -1], atol=1e-12)


@pytest.mark.parametrize("name", PALLETISERS)
def test_the_palletisers_have_the_lengths_and_linkages_of_the_table(name: str) -> None:
    """The file is generated from the table of lengths, and the flange is level for all joint angles."""
    path = Path(__file__).parents[2] / "robots" / name / "robot.json"
    assert path.read_bytes() == PALLETISERS[name].document
    robot = load_robot(name)
    assert robot.joint_letters == "RRRR" and len(robot.links) == 10
    np.testing.assert_allclose(tool_pose(robot, sample(robot, 4))[:3, 2], [0, 0, -1], atol=1e-12)


def test_the_poses_of_the_palletisers_of_kuka_and_abb_are_those_of_the_source() -> None:
    """Height and distance of the flange at q = 0, from the lengths: the arm stretched, the arm bent."""
    for name, point in (("kr180_2_pa", (3.2, 0.0, 0.49)), ("irb660", (1.91, 0.0, 1.833))):
        np.testing.assert_allclose(tool_pose(load_robot(name), np.zeros(4))[:3, 3], point, atol=1e-12)


REACHES = {name: facts for name in CATALOGUE if (facts := shipped_facts(name)).reach is not None}


@pytest.mark.parametrize("name", REACHES)
def test_the_reach_is_that_of_the_data_sheet(name: str) -> None:
    """The greatest distance of the flange from axis 1; data sheets state the distance of the wrist."""
    robot = load_robot(name)
    low, high = np.clip(robot.qlim, -math.pi, math.pi).T
    q = np.random.default_rng(1).uniform(low, high, (2000, robot.n))
    poses = np.asarray(function(trace_fkine(robot)).map(len(q))(q.T))  # (16, N)
    distance = float(np.hypot(poses[3], poses[7]).max())
    reach = REACHES[name].reach
    assert reach is not None and 0.75 * distance < reach < 1.15 * distance


@pytest.mark.parametrize("name", ESTIMATED)
def test_every_link_of_an_estimate_has_a_possible_inertia(name: str) -> None:
    robot = load_robot(name)
    assert inertia_findings(robot) == ()
    assert all(link.mass > 0 and np.linalg.eigvalsh(link.I).min() > 0 for link in robot.links)


@pytest.mark.parametrize("name", [name for name in CATALOGUE if name not in ESTIMATED])
def test_the_inertia_matrix_is_symmetric_and_positive_definite(name: str) -> None:
    robot = load_robot(name)
    M = np.asarray(function(trace_inertia(robot))(sample(robot, 2))).reshape(robot.n, robot.n)
    np.testing.assert_allclose(M, M.T, rtol=0, atol=1e-12 * np.abs(M).max())
    assert np.linalg.eigvalsh(M).min() > 0


@pytest.mark.parametrize("name", ("cobra600", "gen3_6dof", "kr700_pa", "nao_left_leg", "ur5e"))
def test_forward_dynamics_inverts_inverse_dynamics(name: str) -> None:
    """For arms of different kinds; the laws of the other shipped robots are in ``tests/dynamics``."""
    robot = load_robot(name)
    q, random = sample(robot, 2), np.random.default_rng(3)
    qd, qdd = random.uniform(-1, 1, (2, robot.n))
    tau = function(trace_rne(robot))(q, qd, qdd)
    found = np.asarray(function(trace_accel(robot))(q, qd, tau)).ravel()
    np.testing.assert_allclose(found, qdd, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_jacobian_is_the_derivative_of_the_kinematics(name: str) -> None:
    robot = load_robot(name)
    q, step = sample(robot, 5), 1e-6
    fkine = function(trace_fkine(robot))
    J = np.asarray(function(trace_jacob0(robot))(q)).reshape(6, robot.n)
    for k in range(robot.n):
        shift = step * np.eye(robot.n)[k]
        ahead, behind = (np.asarray(fkine(q + sign * shift)).reshape(4, 4) for sign in (1, -1))
        np.testing.assert_allclose((ahead - behind)[:3, 3] / (2 * step), J[:3, k], atol=1e-7)


@pytest.mark.parametrize(
    ("names", "density"),
    [
        (("irb120", "kr6_r900", "rx160", "tx60", "tx90"), ESTIMATES["INDUSTRIAL_DENSITY"]),
        (("fr3", "iiwa7", "ur3e", "ur5e", "ur10e", "ur16e"), ESTIMATES["COLLABORATIVE_DENSITY"]),
    ],
)
def test_the_densities_of_estimates_are_those_of_known_arms(names: tuple[str, ...], density: float) -> None:
    """The estimate of a known moving mass is wrong by a factor of at most 1.7."""
    volume = ESTIMATES["moving_volume"]
    found = [sum(link.mass for link in robot.links) / volume(robot) for robot in map(load_robot, names)]
    assert math.exp(np.mean(np.log(found))) == pytest.approx(density, rel=0.1)
    assert max(max(found) / density, density / min(found)) < 1.7


def test_an_estimate_has_the_mass_of_the_drawn_bodies() -> None:
    robot = load_robot("irb140")
    again = ESTIMATES["estimated"](robot, 2500.0)
    mass = sum(link.mass for link in again.links)
    assert mass == pytest.approx(2500.0 * ESTIMATES["moving_volume"](robot), rel=0.05)
    assert inertia_findings(again) == ()
    assert all(link.motor is None for link in again.links)
