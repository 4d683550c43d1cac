"""Kinematics and dynamics of trees. Each algorithm is written for symbols and traced with a robot's numbers.

``TRACES`` lists all quantities; :mod:`armblocks.dynamics.traces` describes shapes, units and frames.
"""

from armblocks.dynamics.traces import (
    TRACES,
    trace_accel,
    trace_accel_loaded,
    trace_centre_of_mass,
    trace_constrained_motion,
    trace_coriolis,
    trace_difference,
    trace_fkine,
    trace_friction,
    trace_gravload,
    trace_inertia,
    trace_integrate,
    trace_jacob0,
    trace_jacobe,
    trace_kinetic_energy,
    trace_link_poses,
    trace_manipulability,
    trace_normalised,
    trace_position_rates,
    trace_potential_energy,
    trace_rne,
    trace_rne_loaded,
)

__all__ = [
    "TRACES",
    "trace_accel",
    "trace_accel_loaded",
    "trace_centre_of_mass",
    "trace_constrained_motion",
    "trace_coriolis",
    "trace_difference",
    "trace_fkine",
    "trace_friction",
    "trace_gravload",
    "trace_inertia",
    "trace_integrate",
    "trace_jacob0",
    "trace_jacobe",
    "trace_kinetic_energy",
    "trace_link_poses",
    "trace_manipulability",
    "trace_normalised",
    "trace_position_rates",
    "trace_potential_energy",
    "trace_rne",
    "trace_rne_loaded",
]
