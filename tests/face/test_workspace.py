"""Workspaces: closed forms, NumPy statistics, brute-force payloads, and inverse kinematics."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import InputError, RobotError, UnknownNameError
from armblocks.robot import Link, standard_dh
from robots_for_tests import MIXED_ROBOTS, RANDOM_ROBOTS


def planar(*lengths: float, **limits: tuple[float, float]) -> ab.Arm:
    """An arm of parallel axes in the plane z = 0, without limits unless given by the joint's name."""
    links = []
    for k, a in enumerate(lengths, 1):
        link = standard_dh(f"j{k}", a=a, mass=1.0)
        joint = ab.Revolute(limits=ab.JointLimits(position=limits.get(f"j{k}"), torque=50.0))
        links.append(Link(name=f"j{k}", parent=f"j{k - 1}" if k > 1 else None, joint=joint, after=link.after))
    return ab.Arm(ab.Robot(name="planar", links=tuple(links)))


def gantry() -> ab.Arm:
    """Three orthogonal slides with the ranges 0 to 1, -0.5 to 0.5 and 0.2 to 0.5 m."""
    ranges = ((0.0, 1.0), (-0.5, 0.5), (0.2, 0.5))
    links = tuple(
        Link(
            name=name,
            parent="xyz"[k - 1] if k else None,
            joint=ab.Prismatic(
                axis=tuple(np.eye(3)[k].tolist()),
                limits=ab.JointLimits(position=ranges[k], torque=(100.0, 100.0, 60.0)[k]),
            ),
            mass=2.0,
        )
        for k, name in enumerate("xyz")
    )
    return ab.Arm(ab.Robot(name="gantry", links=links, gravity=(0.0, 0.0, -10.0)))


def test_the_region_of_two_links_is_the_annulus_of_the_closed_form() -> None:
    found = ab.workspace(planar(0.7, 0.4), 400_000, cell=0.01, measures=("manipulability", "singularity"))
    area = found.occupied * found.cell**2
    exact = math.pi * (1.1**2 - 0.3**2)
    boundary = 2 * math.pi * (1.1 + 0.3) * found.cell  # cells at the boundary count as a whole
    assert exact - 0.2 * boundary < area < exact + boundary
    assert found.counts.shape[2] == 1 and found.low[2] == pytest.approx(0.0, abs=1e-12)
    radius = np.hypot(*found.points[:, :2].T)
    cosine = (radius**2 - 0.7**2 - 0.4**2) / (2 * 0.7 * 0.4)
    expected = 0.28 * np.sqrt(np.clip(1 - cosine**2, 0, 1))
    np.testing.assert_allclose(found.values["manipulability"], expected, atol=1e-7)
    np.testing.assert_allclose(
        found.values["manipulability"], 0.28 * np.abs(np.sin(found.q[:, 1])), atol=1e-15
    )
    assert found.maps["manipulability"].most[found.counts > 0].max() == pytest.approx(0.28, rel=1e-4)
    assert found.reach == pytest.approx(1.1, rel=1e-3)
    assert found.notes == (
        "j1 has no limits and is sampled over one turn",
        "j2 has no limits and is sampled over one turn",
    )
    assert found.axes == "trans"
    assert found.reached([[0.7, 0.5, 0.0], [0.1, 0.1, 0.0], [3.0, 0.0, 0.0]]).tolist() == [True, False, False]
    assert np.isnan(found.value([3.0, 0.0, 0.0], "manipulability"))


def test_the_region_of_a_gantry_is_its_box_with_the_weight_limit_of_the_vertical_slide() -> None:
    found = ab.workspace(gantry(), 50_000, cell=0.1, measures=("manipulability", "limits", "payload"))
    assert found.counts.shape == (11, 11, 4)  # centres at multiples of the cell, both ends included
    np.testing.assert_allclose([found.low, found.high], [[0, -0.5, 0.2], [1, 0.5, 0.5]], atol=1e-3)
    inner = found.counts[2:-2, 2:-2, 1:-1]
    assert inner.min() > 0.8 * inner.mean() and inner.max() < 1.2 * inner.mean()
    np.testing.assert_allclose(found.values["manipulability"], 1.0)
    np.testing.assert_allclose(found.values["payload"], 60.0 / 10.0 - 2.0)
    ends = np.array([[0, 1], [-0.5, 0.5], [0.2, 0.5]])
    margin = np.minimum(found.q - ends[:, 0], ends[:, 1] - found.q) / (np.ptp(ends, axis=1) / 2)
    np.testing.assert_allclose(found.values["limits"], margin.min(axis=1), atol=1e-14)


def test_a_scara_reaches_a_ring_of_the_height_of_its_stroke() -> None:
    arm = ab.load_robot("cobra600")
    found = ab.workspace(arm, 30_000)
    (stroke,) = [k for k, entry in enumerate(arm.robot.positions) if entry.unit == "m"]
    assert found.high[2] - found.low[2] == pytest.approx(np.ptp(arm.robot.qlim[stroke]), rel=1e-3)
    first = arm.jacob0(found.q)[:, :2, :2]
    np.testing.assert_allclose(found.values["manipulability"], np.abs(np.linalg.det(first)), atol=1e-12)


CASES = [
    *((robot, axes) for robot in (RANDOM_ROBOTS[0], *MIXED_ROBOTS) for axes in ("trans", "rot")),
    (RANDOM_ROBOTS[1], "all"),
]


@pytest.mark.parametrize(("robot", "axes"), CASES, ids=lambda value: getattr(value, "name", value))
def test_maps_agree_with_singular_values_of_the_jacobian(robot: ab.Robot, axes: str) -> None:
    arm = ab.Arm(robot)
    ranges = {entry.name: (-0.5, 0.7) for entry in robot.positions if entry.unit == "m"}
    measures = ("condition", "singularity", "manipulability")
    frame = robot.links[-2].name
    found = ab.workspace(arm, 200, ranges=ranges, measures=measures, axes=axes, frame=frame, cell=0.5)
    assert list(found.maps) == ["manipulability", "singularity", "condition"]
    rows = {"all": slice(0, 6), "trans": slice(0, 3), "rot": slice(3, 6)}[axes]
    values = np.linalg.svd(arm.jacob0(found.q, frame=frame)[:, rows], compute_uv=False)
    scale = values.max(axis=-1)
    np.testing.assert_allclose(found.values["manipulability"], values.prod(axis=-1), atol=1e-9)
    np.testing.assert_allclose(found.values["singularity"] / scale, values[:, -1] / scale, atol=1e-12)
    np.testing.assert_allclose(found.values["condition"], values[:, -1] / values[:, 0], atol=1e-12)
    np.testing.assert_allclose(found.points, arm.fkine(found.q, frame=frame)[:, :3, 3], atol=1e-12)


def test_cells_are_the_statistics_of_all_samples_and_do_not_depend_on_threads() -> None:
    arm = ab.load_robot("puma560")
    found = ab.workspace(arm, 70_000, points=70_000, cell=0.1)  # two parts of the stream
    again = ab.workspace(arm, 70_000, points=10, cell=0.1, threads=2)
    np.testing.assert_array_equal(found.counts, again.counts)
    np.testing.assert_array_equal(found.maps["manipulability"].mean, again.maps["manipulability"].mean)
    assert len(again.points) == 10 and found.counts.sum() == 70_000
    low, high = arm.robot.qlim.T
    assert (found.q >= low - 1e-12).all() and (found.q <= high + 1e-12).all()
    index = np.rint((found.points - found.corner) / found.cell).astype(int)
    flat = np.ravel_multi_index(tuple(index.T), found.counts.shape)
    w = found.values["manipulability"]
    counts = np.bincount(flat, minlength=found.counts.size)
    np.testing.assert_array_equal(counts, found.counts.ravel())
    most, least = np.full(counts.shape, -np.inf), np.full(counts.shape, np.inf)
    np.maximum.at(most, flat, w)
    np.minimum.at(least, flat, w)
    used, entry = counts > 0, found.maps["manipulability"]
    np.testing.assert_array_equal(entry.most.ravel()[used], most[used])
    np.testing.assert_array_equal(entry.least.ravel()[used], least[used])
    mean = np.bincount(flat, w, minlength=counts.size)[used] / counts[used]
    np.testing.assert_allclose(entry.mean.ravel()[used], mean, rtol=1e-12)
    assert np.isnan(entry.most.ravel()[~used]).all()
    other = ab.workspace(arm, 1000, seed=5)
    assert not np.array_equal(other.q, found.q[: len(other.q)])


def test_the_rotation_of_a_ball_joint_is_uniform() -> None:
    link = Link(name="ball", joint=ab.Spherical(), after=ab.Transform(translation=(0.0, 0.0, 0.5)))
    found = ab.workspace(ab.Arm(ab.Robot(name="pendulum", links=(link,))), 20_000, points=20_000)
    assert found.axes == "trans" and found.reach == pytest.approx(0.5)
    np.testing.assert_allclose(np.linalg.norm(found.q, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(found.q.mean(axis=0), 0.0, atol=0.01)
    np.testing.assert_allclose(found.q.T @ found.q / len(found.q), np.eye(4) / 4, atol=0.01)
    direction = found.points / 0.5
    np.testing.assert_allclose(direction.T @ direction / len(direction), np.eye(3) / 3, atol=0.01)


def coupled(limits: ab.JointLimits) -> ab.Arm:
    """Three parallel axes; the last angle is the sum of the others, which are between 0 and 1 rad."""
    one = ab.JointLimits(position=(0.0, 1.0))
    after = ab.Transform(translation=(1.0, 0.0, 0.0))
    links = [
        Link(name=name, parent=parent, joint=ab.Revolute(limits=entry), after=after)
        for name, parent, entry in (("a", None, one), ("b", "a", one), ("c", "b", limits))
    ]
    coupling = ab.Coupling(name="sum", terms=(("c", 1.0), ("a", -1.0), ("b", -1.0)))
    return ab.Arm(ab.Robot(name="r", links=tuple(links), constraints=(coupling,)))


def test_samples_beyond_the_limits_of_coupled_joints_do_not_count() -> None:
    found = ab.workspace(coupled(ab.JointLimits(position=(0.5, 1.5))), 4000, measures="limits", points=4000)
    total = found.q.sum(axis=1)
    assert ((total >= 0.5) & (total <= 1.5)).all()
    assert found.counts.sum() == found.accepted == len(found.q)
    assert found.accepted == pytest.approx(3000, abs=20)
    assert f"samples: 4000, {found.accepted} within the limits of coupled joints" in str(found)
    margins = np.column_stack([1 - np.abs(found.q - 0.5) / 0.5, 1 - np.abs(total - 1.0) / 0.5])
    np.testing.assert_allclose(found.values["limits"], margins.min(axis=1), atol=1e-14)


def test_a_region_without_valid_configuration_is_an_error() -> None:
    with pytest.raises(InputError, match="no sample is within the limits of the joints that couplings"):
        ab.workspace(coupled(ab.JointLimits(position=(5.0, 6.0))), 100)


@pytest.mark.parametrize("name", ["puma560", "irb460", "cobra600", "nao_left_arm"])
@pytest.mark.parametrize("moving", [False, True])
def test_the_payload_is_the_largest_mass_within_the_torque_limits(name: str, moving: bool) -> None:
    arm = ab.load_robot(name)
    random = np.random.default_rng(4)
    qd, qdd = (random.uniform(-1, 1, arm.n) * moving for _ in range(2))
    weight = np.abs(arm.rne(np.zeros(arm.nq), qd, qdd)).max() + 1.0
    torque, centre = np.full(arm.n, 3.0 * weight), (0.05, -0.02, 0.1)
    motion = {"qd": qd, "qdd": qdd} if moving else {}
    found = ab.workspace(arm, 300, measures="payload", torque=torque, centre=centre, points=300, **motion)
    q, mass = found.q, found.values["payload"]
    np.testing.assert_array_equal(ab.payload_capacity(arm, q, qd, qdd, torque=torque, centre=centre), mass)
    checked = 0
    for row, most in zip(q, mass):
        own = np.abs(arm.rne(row, qd, qdd)) / torque
        assert most >= 0.0
        if most == 0.0:
            assert own.max() >= 1.0
        elif np.isfinite(most):
            at, above = (
                np.abs(arm.rne(row, qd, qdd, payload=ab.Payload(mass=m, centre=centre))) / torque
                for m in (most, 1.001 * most + 1e-6)
            )
            assert own.max() <= 1.0 and at.max() == pytest.approx(1.0, abs=1e-9) and above.max() > 1.0
            checked += 1
    assert checked > 100


def test_the_payload_at_another_frame_and_on_a_trajectory() -> None:
    arm = planar(0.5, 0.5)
    robot = ab.Robot(name="vertical", links=arm.robot.links, gravity=(0.0, -10.0, 0.0))
    arm = ab.Arm(robot)  # massless links: the mass at a frame has the lever of its horizontal distance
    assert ab.payload_capacity(arm, [0.0, 0.0]) == pytest.approx(50.0 / 10.0)
    assert ab.payload_capacity(arm, [0.0, 0.0], frame="j1") == pytest.approx(50.0 / (10.0 * 0.5))
    assert ab.payload_capacity(arm, [0.0, 0.0], centre=(0.5, 0, 0)) == pytest.approx(50.0 / 15.0)
    assert np.isinf(ab.payload_capacity(arm, [np.pi / 2, 0.0]))
    heavy = ab.Arm(ab.load_robot("puma560").robot)
    weak = ab.payload_capacity(heavy, [[0.0] * 6, [0.0, np.pi, 0, 0, 0, 0]], torque=np.full(6, 1e-3))
    assert weak.tolist() == [0.0, 0.0]  # the weight alone exceeds the limits, in both directions
    path = ab.jtraj([np.pi / 2, 0.0], [0.0, 0.0], np.linspace(0, 4, 80))
    mass = ab.payload_capacity(arm, path)
    assert isinstance(mass, float) and 3.0 < mass < 5.0
    report = ab.trajectory_report(arm, path, payload=mass)
    assert report.ratios[:, 2].max() == pytest.approx(1.0, rel=1e-9)


def test_the_map_agrees_with_the_searches_of_inverse_kinematics() -> None:
    arm = ab.load_robot("puma560")
    found = ab.workspace(arm, 300_000, cell=0.1)
    random = np.random.default_rng(2)
    points = random.uniform([-1.2, -1.2, -0.4], [1.2, 1.2, 1.8], (250, 3))
    targets = np.tile(np.eye(4), (len(points), 1, 1))
    targets[:, :3, 3] = points
    solved = np.asarray(arm.ikine(targets, mask=[1, 1, 1, 0, 0, 0]).success)
    reached = found.reached(points)
    steps = 0.11 * np.array([np.eye(3), -np.eye(3)]).reshape(6, 3)
    near = np.stack([found.reached(points + step) for step in steps])
    inside, outside = near.all(axis=0) & reached, ~near.any(axis=0) & ~reached
    assert inside.sum() > 30 and outside.sum() > 30
    assert solved[inside].all() and not solved[outside].any()


def test_the_dexterous_index_of_three_parallel_axes_is_the_share_of_the_closed_form() -> None:
    a, b, c = 0.5, 0.3, 0.1
    arm = planar(a, b, c)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False) + 0.05
    directions = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = np.array([[r, 0.1, 0.0] for r in (0.12, 0.22, 0.5, 0.75, 0.83, 1.2)])
    index = ab.dexterity(arm, points, directions, axis="x", restarts=40)
    wrist = np.linalg.norm(points[:, None] - c * directions, axis=-1)
    expected = ((wrist >= a - b) & (wrist <= a + b)).mean(axis=1)
    np.testing.assert_allclose(index, expected, atol=1e-12)
    assert expected.min() == 0.0 and expected.max() == 1.0 and ((expected > 0) & (expected < 1)).sum() >= 2
    assert ab.dexterity(arm, points[2], directions, axis="x").shape == ()


def test_an_arm_with_a_spherical_wrist_points_in_all_directions_inside() -> None:
    arm = ab.load_robot("puma560")
    assert ab.dexterity(arm, [0.45, 0.15, 0.3], 20, limits=False) == 1.0
    assert ab.dexterity(arm, [[3.0, 0.0, 0.0]], 5).tolist() == [0.0]


def test_slices_are_layers_of_cells() -> None:
    found = ab.workspace(gantry(), 5000, cell=0.1, measures=("manipulability", "limits"))
    layer = found.slice("y", 0.26)
    assert (layer.normal, layer.axes) == ("y", ("x", "z")) and layer.at == pytest.approx(0.3)
    np.testing.assert_array_equal(layer.counts, found.counts[:, 8, :])
    np.testing.assert_array_equal(layer.maps["limits"].mean, found.maps["limits"].mean[:, 8, :])
    np.testing.assert_allclose([layer.first[0], layer.second[-1]], [0.0, 0.5], atol=1e-12)
    assert np.count_nonzero(found.slice("z").counts) == np.count_nonzero(found.counts, axis=(0, 1)).max()
    with pytest.raises(InputError, match=r"at = 2.0 is outside of the reached cells.*-0.55 to 0.55 m"):
        found.slice("y", 2.0)
    with pytest.raises(UnknownNameError, match="axis named 'r'"):
        found.slice("r")


def test_files_have_the_cells_and_the_points(tmp_path: Path) -> None:
    found = ab.workspace(gantry(), 2000, cell=0.2, measures=("limits", "payload"), points=50)
    names = [
        "x",
        "y",
        "z",
        "count",
        *(f"{m} {s}" for m in ("limits", "payload") for s in ("most", "least", "mean")),
    ]
    table = found.table()
    assert list(table) == names and len(table["x"]) == found.occupied
    csv = np.genfromtxt(found.save(tmp_path / "cells.csv"), delimiter=",", skip_header=1)
    np.testing.assert_array_equal(csv, np.column_stack(list(table.values())))
    with np.load(found.save(tmp_path / "cells.npz")) as arrays:
        np.testing.assert_array_equal(arrays["limits mean"], table["limits mean"])
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = parquet.read_table(found.save(tmp_path / "points.parquet", content="points"))
    assert columns.column_names == ["x", "y", "z", "q x", "q y", "q z", "limits", "payload"]
    np.testing.assert_array_equal(columns["q y"].to_numpy(), found.q[:, 1])
    for name in ("map.svg", "map.png", "map.pdf"):
        assert found.save(tmp_path / name).stat().st_size > 2000
    written = found.write(tmp_path / "report")
    assert [path.name for path in written] == [
        *("workspace.html", "workspace.csv", "points.csv", "limits.svg", "payload.svg")
    ]
    assert "volume of these cells" in written[0].read_text(encoding="utf-8")
    with pytest.raises(UnknownNameError, match=r"file type named '\.doc'"):
        found.save(tmp_path / "cells.doc")
    with pytest.raises(UnknownNameError, match="content named 'all'"):
        found.save(tmp_path / "cells.csv", content="all")


def test_pictures_show_the_measure_and_the_plane() -> None:
    found = ab.workspace(gantry(), 2000, cell=0.1, measures=("limits", "payload"))
    picture = found.picture()
    assert "Distance to joint limits, largest" in picture.description
    assert "Payload, smallest" in found.picture("payload", "least").description
    assert "Samples in a cell" in found.picture("count", normal="z", at=0.3).description
    assert "samples" in repr(found) or "Workspace of gantry" in repr(found)
    line = ab.workspace(planar(0.4, j1=(0.0, 0.0)), 10)  # one point
    assert line.occupied == 1 and line.picture().marks
    for wrong in ({"measure": "speed"}, {"statistic": "median"}):
        with pytest.raises(UnknownNameError, match=r"measure named 'speed'|statistic named 'median'"):
            found.picture(**wrong)
    with pytest.raises(InputError, match=r"points has the shape \(2,\)"):
        found.reached([0.0, 1.0])


def test_a_jacobian_without_full_rank_is_named() -> None:
    found = ab.workspace(planar(0.5, 0.4, 0.3), 500, axes="all")
    assert found.maps["manipulability"].most[found.counts > 0].max() > 0.1
    flat = ab.workspace(planar(0.5, 0.4, 0.3), 500, axes="trans")
    assert "manipulability is 0 everywhere up to rounding" in flat.notes[-1]


def test_results_are_pickled() -> None:
    found = ab.workspace(gantry(), 100)
    copy = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(copy.counts, found.counts)
    assert copy.notes == found.notes


WRONG = [
    ({"samples": 0}, "samples = 0", InputError),
    ({"samples": 10.5}, "samples = 10.5", InputError),
    ({"measures": "speed"}, "measure named 'speed'", UnknownNameError),
    ({"measures": ()}, "there is no measure. Allowed: one or more of condition", InputError),
    ({"axes": "linear"}, "choice of axes named 'linear'", UnknownNameError),
    ({"cell": -1.0}, "cell = -1.0", InputError),
    ({"frame": "hand"}, "frame named 'hand'", UnknownNameError),
    ({"ranges": {"w": (0, 1)}}, "coordinate named 'w'", UnknownNameError),
    ({"ranges": {"x": (0, 2)}}, r"the range of x is \(0, 2\)", InputError),
    ({"ranges": {"x": 1.0}}, "the range of x is 1.0", InputError),
    ({"ranges": {"x": (np.nan, 1.0)}}, "two finite numbers, the lowest first", InputError),
    ({"measures": "payload", "torque": [1.0]}, r"", None),
    ({"measures": "payload", "centre": (0, 0)}, "centre = .*three finite numbers", InputError),
    ({"measures": "payload", "qd": [1.0]}, "qd has 1 joint", InputError),
    ({"measures": "payload", "torque": -1.0}, "torque = -1.0", InputError),
    ({"points": -1}, "points = -1", InputError),
    ({"cell": 1e-5}, "cells of 1e-05 m give a box", InputError),
    ({"cell": 1e-25}, "cells of 1e-25 m give a box", InputError),
]


@pytest.mark.parametrize(("arguments", "message", "kind"), WRONG)
def test_wrong_arguments_are_named(arguments: dict, message: str, kind: type[Exception] | None) -> None:
    call = {"samples": 100} | arguments
    if kind is None:
        assert ab.workspace(gantry(), **call).samples == 100
        return
    with pytest.raises(kind, match=message):
        ab.workspace(gantry(), **call)


def test_robots_without_a_region_are_named() -> None:
    slide = Link(name="x", joint=ab.Prismatic(), mass=1.0)
    free = ab.Arm(ab.Robot(name="r", links=(slide,)))
    with pytest.raises(RobotError, match=r"the displacement of joint 'x' has no limits.*ranges=\{'x'"):
        ab.workspace(free)
    assert ab.workspace(free, 100, ranges={"x": (0, 2)}).high[2] == pytest.approx(2.0, abs=0.05)
    with pytest.raises(InputError, match="no joint of robot 'r' has a torque limit"):
        ab.workspace(free, 10, ranges={"x": (0, 2)}, measures="payload")
    fixed = Link(name="x", joint=ab.Fixed(), mass=1.0)
    with pytest.raises(RobotError, match="no joint moves"):
        ab.workspace(ab.Arm(ab.Robot(name="r", links=(fixed,))))
    loop = ab.RevoluteClosure(name="loop", first=ab.Attachment(), second=ab.Attachment(link="j2"))
    robot = ab.Robot(name="closed", links=planar(1.0, 1.0).robot.links, constraints=(loop,))
    for function in (ab.workspace, lambda arm: ab.payload_capacity(arm, [0, 0])):
        with pytest.raises(RobotError, match="the robot has closed loops"):
            function(ab.Arm(robot))
    ball = Link(name="ball", joint=ab.Spherical())
    with pytest.raises(InputError, match="a range of a quaternion is given"):
        ab.workspace(ab.Arm(ab.Robot(name="b", links=(ball,))), ranges={"ball.qw": (0, 1)})


def test_wrong_payload_and_dexterity_arguments_are_named() -> None:
    arm = planar(0.5, 0.5)
    with pytest.raises(InputError, match=r"qd has the shape \(3,\)"):
        ab.payload_capacity(arm, [0.0, 0.0], [1.0, 2.0, 3.0])
    with pytest.raises(InputError, match=r"\(2,\) or \(N, 2\), finite numbers"):
        ab.payload_capacity(arm, [0.0, np.nan])
    with pytest.raises(InputError, match="qd or qdd is given with a trajectory"):
        ab.payload_capacity(arm, ab.jtraj([0, 0], [1, 1], 5), [0.0, 0.0])
    with pytest.raises(UnknownNameError, match="axis named 'r'"):
        ab.dexterity(arm, [0, 0, 0], axis="r")
    with pytest.raises(InputError, match=r"points has the shape \(2,\)"):
        ab.dexterity(arm, [0, 0])
    with pytest.raises(InputError, match="or a vector without direction"):
        ab.dexterity(arm, [0, 0, 0], [[0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"directions = 2\.5"):
        ab.dexterity(arm, [0, 0, 0], 2.5)
    assert ab.dexterity(arm, [0.5, 0.5, 0], np.int64(3)) == ab.dexterity(arm, [0.5, 0.5, 0], 3)
