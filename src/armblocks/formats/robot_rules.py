"""The rules that findings about robots of every format refer to."""

from __future__ import annotations

from armblocks.formats.file_findings import Rule

INERTIA = Rule(
    code="robot-inertia",
    allowed="moments of inertia that are not negative, none above the sum of the other two",
    remedy="check the unit and the axes of the inertia, and whether it is about the centre of mass",
)
IMPLAUSIBLE = Rule(
    code="robot-units",
    allowed="angles in rad, lengths in m, inertias in kg m2, gravity as the acceleration of a falling body",
    remedy="convert the value, or ignore this finding if the value is right",
)
NO_MASS = Rule(
    code="robot-mass-missing",
    allowed="mass or inertia that each joint moves, or motor inertia",
    remedy="add the mass and the inertia of the links; kinematics do not depend on them",
)
WARNED = Rule(code="robot-warning", allowed="files that are read without warnings", remedy="see the message")

LINT_RULES = (INERTIA, IMPLAUSIBLE, NO_MASS, WARNED)
"""The rules of all formats."""


def left_out_coupling(contradiction: float | None) -> str:
    """The finding about a coupling that is omitted; see :func:`remaining_coupling` for ``contradiction``."""
    if contradiction is None:
        return "the coupling follows from other constraints; it is omitted"
    what = f"the coupling contradicts other constraints, by {abs(contradiction):.3g} rad or m"
    return f"{what}; it is omitted"
