"""The numbers of operations in the compiled equations of three arms.

Support for general joint types must not increase them. The numbers of puma560 and kr180 are also in a table
in ``benchmarks/RESULTS.md``. If a number decreases, update it here and in that table.
"""

import pytest

from armblocks.compiler.from_casadi import tape_from
from armblocks.dynamics import TRACES
from armblocks.formats.robot_files import shipped_robot

COUNTS = {
    ("puma560", "fkine"): (26, 1, 25, 0, 12),
    ("puma560", "jacob0"): (29, 10, 18, 0, 10),
    ("puma560", "rne"): (92, 55, 104, 0, 10),
    ("puma560", "inertia"): (56, 47, 43, 0, 8),
    ("puma560", "gravload"): (19, 2, 10, 0, 8),
    ("puma560", "coriolis"): (273, 82, 236, 0, 10),
    ("puma560", "accel"): (167, 109, 175, 4, 10),
    ("kr180", "fkine"): (13, 1, 12, 0, 6),
    ("kr180", "jacob0"): (14, 9, 11, 0, 4),
    ("kr180", "rne"): (56, 33, 59, 0, 6),
    ("kr180", "inertia"): (18, 17, 18, 0, 6),
    ("kr180", "gravload"): (6, 1, 4, 0, 4),
    ("kr180", "coriolis"): (102, 34, 79, 0, 6),
    ("kr180", "accel"): (80, 49, 78, 3, 6),
    ("kr180_2_pa", "rne"): (62, 21, 62, 0, 8),
    ("kr180_2_pa", "inertia"): (23, 29, 19, 0, 6),
    ("kr180_2_pa", "gravload"): (7, 5, 6, 0, 6),
}
"""Numbers of multiplies, adds, fused multiply-adds, divisions with square roots, and elementary functions;
robots without friction."""


@pytest.mark.parametrize(("robot", "name"), COUNTS)
def test_the_operations_are_those_of_the_published_table(robot: str, name: str):
    count = tape_from(TRACES[name](shipped_robot(robot).nofriction())).count
    divisions = count.divisions + count.square_roots
    fused = count.fused_multiply_adds
    assert (count.multiplies, count.adds, fused, divisions, count.function_calls) == COUNTS[robot, name]
