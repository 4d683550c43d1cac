"""Tracing eliminates the zeros of a robot's parameters: short equations make fast kernels."""

from collections import Counter

import casadi
import pytest

from armblocks.dynamics import TRACES
from armblocks.dynamics.base_parameters import regrouped
from armblocks.equations import TracedFunction
from armblocks.robot import Robot, standard_dh
from armblocks.robot.tree import KinematicTree
from robots_for_tests import build_kr180, build_puma560

ARITHMETIC = {
    casadi.OP_ADD,
    casadi.OP_SUB,
    casadi.OP_MUL,
    casadi.OP_SQ,
    casadi.OP_TWICE,
}


def arithmetic(traced: TracedFunction) -> int:
    """Return the number of multiplications and additions of one evaluation."""
    function = traced.casadi_function()
    count = Counter(function.instruction_id(k) for k in range(function.n_instructions()))
    return sum(count[operation] for operation in ARITHMETIC)


@pytest.mark.parametrize(
    ("robot", "name", "limit"),
    [
        # Upper limits of the design. Present counts are 379, 650, 77 and 75, and 223 for the paper's arm.
        (build_puma560(), "rne", 500),
        (build_puma560(), "accel", 750),
        (build_puma560(), "fkine", 100),
        (build_puma560(), "jacob0", 100),
        (build_kr180(), "rne", 350),
    ],
    ids=lambda value: getattr(value, "name", str(value)),
)
def test_operation_counts_are_below_their_limits(robot: Robot, name: str, limit: int):
    assert arithmetic(TRACES[name](robot)) <= limit


def test_regrouping_moves_the_mass_of_revolute_links_to_their_parents(puma560: Robot):
    for body in regrouped(KinematicTree.of(puma560)).bodies:
        assert body.inertia.mass == 0
        assert body.inertia.first[2] == 0
        assert body.inertia.second.yy == 0


def test_offsets_of_quarter_turns_need_no_arithmetic():
    for quarters in range(-4, 5):
        link = standard_dh("l", a=1.0, offset=quarters * 1.5707963267948966)
        assert arithmetic(TRACES["fkine"](Robot(name="r", links=(link,)))) == 0
