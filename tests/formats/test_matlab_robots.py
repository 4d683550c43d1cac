"""Links and robots of scripts: both toolbox families, their argument orders, defaults, copies and handles."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from armblocks.errors import ArmblocksWarning, FormatError, InertiaWarning, UnknownNameError
from armblocks.formats import load_robot, read_script
from armblocks.formats.shipped import shipped_folder
from armblocks.robot import (
    DhConvention,
    FrictionModel,
    JointLimits,
    Motor,
    Prismatic,
    Revolute,
    Robot,
    modified_dh,
    standard_dh,
)

PRINTED = Path(__file__).with_name("kr180_as_printed.m")
"""Both parts of Figure 5 of the paper, line by line as printed, without blank lines."""


def robot(text: str, **options: FrictionModel) -> Robot:
    """The only robot of a script."""
    (result,) = read_script(text.encode(), "test.m", **options).robots.values()
    return result


# -- the paper ---------------------------------------------------------------------------------------------


def with_table_1(robot: Robot) -> Robot:
    """The joint ranges and speeds of Table 1 of the paper, which its script does not contain."""
    table = [(-185, 185, 105), (-39, 90, 105), (-71, 109, 95), (-270, 270, 300)]
    for link, (low, high, speed) in zip(robot.links, table, strict=True):
        limits = JointLimits(position=(math.radians(low), math.radians(high)), speed=math.radians(speed))
        robot = robot.with_link(link.name, joint=replace(link.joint, limits=limits))
    return robot


def without_limits(full: Robot) -> Robot:
    for link in full.links:
        full = full.with_link(link.name, joint=replace(link.joint, limits=JointLimits()))
    return full


def test_the_papers_script_equals_the_shipped_kr180() -> None:
    data = (shipped_folder("robots") / "kr180" / "kr180.m").read_bytes()
    (script,) = read_script(data, "kr180.m").robots.values()
    shipped = load_robot("kr180")
    assert with_table_1(script) == shipped
    assert script == without_limits(shipped)


def test_the_papers_script_loads_as_it_is_printed() -> None:
    with pytest.warns(
        ArmblocksWarning, match=r"printed\.m: lines 15, 17, 20, 23, 26 are split as on a printed"
    ):
        (script,) = read_script(PRINTED.read_bytes(), "printed.m").robots.values()
    assert with_table_1(script) == load_robot("kr180")


def test_the_papers_script_loads_with_its_blank_lines(tmp_path: Path) -> None:
    path = tmp_path / "kr180.m"
    path.write_bytes(PRINTED.read_bytes().replace(b"\n", b"\r\n\r\n"))
    with pytest.warns(ArmblocksWarning) as caught:
        script = load_robot(path)
    assert with_table_1(script) == load_robot("kr180")
    kinds = [warning.category for warning in caught]
    assert kinds.count(InertiaWarning) == 2, "links 1 and 3 have inertias that no body can have"
    assert "link 'link1': the link has inertia but no mass" in str([w.message for w in caught])


def test_the_papers_script_has_all_numbers_of_its_tables() -> None:
    """Compare with the tables of the paper, link by link, without constructors of the package."""
    arm = load_robot("kr180")
    assert (arm.name, arm.manufacturer, arm.comment) == ("KR180", "KUKA Robotics", "params of 8/95")
    assert arm.joint_letters == "RRRR"
    assert [link.mass for link in arm.links] == [0, 150, 100, 50]
    rows = [(link.dh.alpha, link.dh.a, link.dh.d, link.dh.offset) for link in arm.links if link.dh]
    assert rows == [(math.pi / 2, 0.35, 0.75, 0), (0, 0, 1.25, 0), (math.pi / 2, 1.6, 0, 0), (0, 0, 2.6, 0)]
    centres = [link.centre_of_mass for link in arm.links]
    assert centres == [(0, 0, 0.3), (-0.1, -0.1, 0), (0.1, 0.05, 0), (0, 0, 0.18)]
    moments = [tuple(np.diag(link.I)) for link in arm.links]
    assert moments == [(0, 0.35, 0), (0.13, 0.524, 0.539), (0.066, 0.086, 0.0125), (1.8e-3, 1.3e-3, 1.8e-3)]
    assert arm.motors == (
        Motor(
            inertia=200e-6, gear_ratio=-62.6111, viscous_friction=1.48e-3, coulomb_friction=(0.395, -0.435)
        ),
        Motor(
            inertia=200e-6, gear_ratio=107.815, viscous_friction=0.817e-3, coulomb_friction=(0.126, -0.071)
        ),
        Motor(
            inertia=200e-6, gear_ratio=-53.7063, viscous_friction=1.38e-3, coulomb_friction=(0.132, -0.105)
        ),
        Motor(
            inertia=33e-6, gear_ratio=76.0364, viscous_friction=71.2e-6, coulomb_friction=(11.2e-3, -16.9e-3)
        ),
    )
    np.testing.assert_allclose(np.degrees(arm.qlim), [[-185, 185], [-39, 90], [-71, 109], [-270, 270]])
    np.testing.assert_allclose(np.degrees(arm.speed_limits), [105, 105, 95, 300])
    assert arm.gravity == (0, 0, -9.81)
    assert arm.friction_model is FrictionModel.SQUARED_GEAR


def test_whole_statements_in_comments_stay_comments() -> None:
    text = "L{1} = link([0 1 0 0]); L{1}.m = 1;\n% L{1}.m = 5;\n% L{1}.m = 6\n% see L{1}.m\nr = robot(L);"
    assert robot(text).links[0].mass == 1


def test_commented_out_statement_over_two_lines_stays_comment() -> None:
    text = "L{1} = link([0 1 0 0]); L{1}.m = 1;\n% L{1}.m = ...\n%   5;\nr = robot(L);"
    assert robot(text).links[0].mass == 1


# -- releases up to 8 --------------------------------------------------------------------------------------


def test_link_of_release_8_reads_alpha_first() -> None:
    text = "L{1} = link([0.1 0.2 0.3 0.4 1 0.5]); L{2} = link([0.1 0.2 0.3 0.4]); r = robot(L);"
    sliding, turning = robot(text).links
    assert sliding == standard_dh("link1", alpha=0.1, a=0.2, theta=0.3, d=0.4, sigma=1, offset=0.5)
    assert turning == standard_dh("link2", alpha=0.1, a=0.2, theta=0.3, d=0.4, parent="link1")
    assert isinstance(sliding.joint, Prismatic)
    assert isinstance(turning.joint, Revolute)


def test_the_convention_is_recognised_by_its_first_three_letters() -> None:
    (link,) = robot("L = {link([0.1 0.2 0 0.4], 'modif')}; r = robot(L);").links
    assert link == modified_dh("link1", alpha=0.1, a=0.2, d=0.4)
    assert link.dh is not None
    assert link.dh.convention is DhConvention.MODIFIED


DYN = "0.1 0.2 0 0.4 0 5 1 2 3 0.1 0.2 0.3 0.01 0.02 0.03"


def test_the_legacy_dyn_row_of_release_8_starts_with_alpha() -> None:
    (link,) = robot(f"d = [{DYN} 2e-4 -60 1e-3 0.4 -0.5]; r = robot(d);").links
    assert link == standard_dh(
        "link1",
        alpha=0.1,
        a=0.2,
        d=0.4,
        mass=5,
        centre_of_mass=(1, 2, 3),
        inertia=(0.1, 0.2, 0.3, 0.01, 0.02, 0.03),
        motor=Motor(inertia=2e-4, gear_ratio=-60, viscous_friction=1e-3, coulomb_friction=(0.4, -0.5)),
    )


def test_a_legacy_dyn_row_may_omit_trailing_values() -> None:
    (link,) = robot(f"r = robot([{DYN} 2e-4]);").links
    assert link.motor == Motor(inertia=2e-4, gear_ratio=1)
    (link,) = robot(f"r = robot([{DYN}]);").links
    assert (link.mass, link.motor) == (5, None)


def test_robot_from_a_matrix_is_named_by_its_variable() -> None:
    assert robot("stanford = [0 1 0 0 0\n0 1 0 0 1]; r = robot(stanford);").name == "stanford"
    assert robot("r = robot([0 1 0 0]);").name == "noname"


def test_name_arguments_of_robot_are_read() -> None:
    result = robot("L{1} = link([0 1 0 0]); r = robot(L, 'A', 'B', 'C');")
    assert (result.name, result.manufacturer, result.comment) == ("A", "B", "C")


def test_values_are_copied_in_release_8() -> None:
    text = (
        "L{1} = link([0 1 0 0]); L{1}.m = 1; M = L; a = L{1}; r = robot(L); s = r;"
        "L{1}.m = 2; a.m = 3; M{1}.m = 4; s.name = 'other'; clear L"
    )
    script = read_script(text.encode(), "a.m")
    assert [member.links[0].mass for member in script.robots.values()] == [1, 1]
    assert script.robots["s"].name == "other"


def test_constructors_copy_their_arguments_in_release_8() -> None:
    text = (
        "a = link([0 1 0 0]); a.m = 1; b = link(a); b.m = 2; L = {a b};"
        "r = robot(L); s = robot(r, 'S'); s.name"
    )
    script = read_script(text.encode(), "a.m")
    assert [link.mass for link in script.robots["r"].links] == [1, 2]
    assert (script.robots["s"].name, script.robots["r"].name) == ("S", "noname")


def test_nested_fields_are_read_and_set() -> None:
    text = (
        "L{1} = link([0 1 0 0]); L{1}.r = [1 2 3]; L{1}.r(2) = 5; L{1}.I = eye(3); L{1}.Tc = 0.4;"
        "L{1}.sigma = 'P'; L{1}.mdh = 0; x = [L{1}.A L{1}.r L{1}.Tc L{1}.sigma]; y = L{1}.m;"
        "r = robot(L); r.link{1}.m = 7; n = r.n; z = r.name; g = r.gravity';"
    )
    script = read_script(text.encode(), "a.m")
    np.testing.assert_array_equal(script.variables["x"], [[1, 1, 5, 3, 0.4, -0.4, 1]])
    assert script.variables["y"].size == 0  # type: ignore[union-attr]
    assert (script.variables["n"], script.variables["z"]) == (1, "noname")
    np.testing.assert_array_equal(script.variables["g"], [[0, 0, 9.81]])
    assert script.robots["r"].links[0].mass == 7


def test_gravity_changes_its_sign_when_read() -> None:
    assert robot("r = robot([0 1 0 0]); r.gravity = [0; 1; -2];").gravity == (0, -1, 2)


def test_base_and_tool_are_poses() -> None:
    result = robot("r = robot([0 1 0 0]); r.base = transl(1, 2, 3)*trotx(pi/2); r.tool = transl([0 0 0.1]);")
    assert result.base.translation == (1, 2, 3)
    assert result.tool.translation == (0, 0, 0.1)


def test_the_default_gear_ratio_is_one() -> None:
    (link,) = robot("L = {link([0 1 0 0])}; L{1}.Jm = 1e-3; r = robot(L);").links
    assert link.motor == Motor(inertia=1e-3, gear_ratio=1)


# -- releases 9 and later ----------------------------------------------------------------------------------


def test_link_of_release_9_reads_theta_first() -> None:
    text = (
        "L(1) = Link([0.3 0.4 0.2 0.1 1 0.5], 'modified'); L(2) = Link([0 0.4 0.2 0.1], 'mod');"
        "r = SerialLink(L);"
    )
    sliding, turning = robot(text).links
    assert sliding == modified_dh("link1", theta=0.3, d=0.4, a=0.2, alpha=0.1, sigma=1, offset=0.5)
    assert turning == modified_dh("link2", d=0.4, a=0.2, alpha=0.1, parent="link1")


def test_legacy_dyn_row_of_release_9_starts_with_theta() -> None:
    (link,) = robot("r = SerialLink(Link([0 0.4 0.2 0.1 0 5 1 2 3 0.1 0.2 0.3 0 0 0 2e-4 50 0 1 -1]));").links
    assert link.dh is not None
    assert (link.dh.d, link.dh.a, link.dh.alpha, link.mass) == (0.4, 0.2, 0.1, 5)
    assert link.motor == Motor(inertia=2e-4, gear_ratio=50, coulomb_friction=(1, -1))


@pytest.mark.parametrize(
    ("text", "sigma"),
    [
        ("Link('d', 0.4, 'a', 0.2)", 0),
        ("Link('theta', 0.3, 'a', 0.2)", 1),
        ("Link('a', 0.2)", 0),
        ("Link('prismatic', 'a', 0.2)", 1),
        ("Link('revolute', 'a', 0.2, 'd', 0.4)", 0),
        ("Link('sigma', 1, 'a', 0.2)", 1),
        ("Revolute('d', 0.4, 'a', 0.2)", 0),
        ("Prismatic('theta', 0.3, 'a', 0.2)", 1),
        ("RevoluteMDH('a', 0.2)", 0),
        ("PrismaticMDH('a', 0.2)", 1),
        ("Link()", 0),
    ],
)
def test_named_arguments_determine_the_joint_type(text: str, sigma: int) -> None:
    (link,) = robot(f"r = SerialLink({text});").links
    assert link.dh is not None
    assert link.dh.sigma == sigma
    assert link.dh.convention is (DhConvention.MODIFIED if "MDH" in text else DhConvention.STANDARD)


def test_all_link_properties_can_be_named_arguments() -> None:
    text = (
        "L = Link('d', 0.4, 'a', 0.2, 'alpha', 0.1, 'offset', 0.5, 'qlim', [-1 2], 'm', 3, 'r', [1 2 3], "
        "'I', [1 1 1], 'Jm', 1e-4, 'G', 50, 'B', 1e-3, 'Tc', [0.1 -0.2], 'modified');\nr = SerialLink(L);"
    )
    (link,) = robot(text).links
    assert link == modified_dh(
        "link1",
        d=0.4,
        a=0.2,
        alpha=0.1,
        offset=0.5,
        limits=JointLimits(position=(-1, 2)),
        mass=3,
        centre_of_mass=(1, 2, 3),
        inertia=(1, 1, 1),
        motor=Motor(inertia=1e-4, gear_ratio=50, viscous_friction=1e-3, coulomb_friction=(0.1, -0.2)),
    )


def test_serial_link_accepts_options() -> None:
    text = (
        "r = SerialLink([0 0 1 0; 0 0 2 0], 'name', 'A', 'manufacturer', 'B', 'comment', 'C', 'modified', "
        "'base', transl(1, 0, 0), 'tool', transl(0, 1, 0), 'gravity', [0 0 1.6], 'qlim', [-1 1; -inf inf], "
        "'offset', [0.1 0.2], 'plotopt', {'workspace', [-1 1]});"
    )
    result = robot(text)
    assert (result.name, result.manufacturer, result.comment) == ("A", "B", "C")
    assert result.gravity == (0, 0, -1.6)
    assert [link.joint.limits.position for link in result.links] == [(-1, 1), None]
    assert [link.joint.offset for link in result.links] == [0.1, 0.2]
    assert result.base.translation == (1, 0, 0)
    assert result.tool.translation == (0, 1, 0)
    assert all(link.dh and link.dh.convention is DhConvention.MODIFIED for link in result.links)


def test_handles_are_shared_in_release_9() -> None:
    text = "L(1) = Link([0 0 1 0]); r = SerialLink(L); L(1).m = 2; s = r; s.name = 'x'; r.links(1).G = 5;"
    result = robot(text)
    assert (result.name, result.links[0].mass, result.gear_ratios[0]) == ("x", 2, 5)


@pytest.mark.parametrize("links", ["[L1 L2]", "{L1 L2}", "[[] L1 L2]", "[L1 L2]'", "[[L1] [L2]]"])
def test_links_can_be_collected_in_arrays_and_cell_arrays(links: str) -> None:
    assert robot(f"L1 = Link([0 0 1 0]); L2 = Link(L1); L2.a = 2; r = SerialLink({links});").n == 2


def test_copy_of_a_serial_link_has_its_own_name() -> None:
    text = "r = SerialLink(Link([0 0 1 0]), 'name', 'A', 'comment', 'C'); s = SerialLink(r, 'name', 'B');"
    script = read_script(text.encode(), "a.m")
    assert [(member.name, member.comment) for member in script.robots.values()] == [("A", "C"), ("B", "C")]


# -- files -------------------------------------------------------------------------------------------------


def test_friction_model_is_chosen_by_name(tmp_path: Path) -> None:
    path = tmp_path / "r.m"
    path.write_text("r = robot([0 1 0 0]);")
    assert load_robot(path).friction_model is FrictionModel.SQUARED_GEAR
    chosen = load_robot(path, friction_model=FrictionModel.SIGNED_GEAR)
    assert chosen.friction_model is FrictionModel.SIGNED_GEAR


def test_poses_of_a_script_are_kept() -> None:
    variables = read_script(b"r = robot([0 1 0 0]); qz = [0]; qn = [pi/4];", "a.m").variables
    np.testing.assert_array_equal(variables["qn"], [[math.pi / 4]])
    assert sorted(variables) == ["qn", "qz"]


TWO_ROBOTS = "left = robot([0 1 0 0]); left.name = 'L'; right = robot([0 2 0 0]); copy = right;"


def test_one_of_several_robots_is_selected_by_name(tmp_path: Path) -> None:
    path = tmp_path / "two.m"
    path.write_text(TWO_ROBOTS)
    assert load_robot(path, name="right").links[0].dh == standard_dh("link1", a=2).dh
    assert load_robot(path, name="L").links[0].dh == standard_dh("link1", a=1).dh
    with pytest.raises(
        FormatError, match=r"the file defines 2 robots. Allowed: left, right. Fix: select one"
    ):
        load_robot(path)
    with pytest.raises(UnknownNameError, match=r"there is no robot named 'lefft'.*did you mean 'left'"):
        load_robot(path, name="lefft")


def test_script_without_robot_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "none.m"
    path.write_text("L{1} = link([0 1 0 0]);")
    with pytest.raises(FormatError, match="the file defines no robot"):
        load_robot(path)
