"""Names of URDF elements."""

from __future__ import annotations


def free_joint_name(name: str, used: set[str]) -> str:
    """The first of ``name_2``, ``name_3``, … that is not used."""
    number = 2
    while f"{name}_{number}" in used:
        number += 1
    return f"{name}_{number}"
