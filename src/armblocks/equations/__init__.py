"""The narrow waist: typed sets of equations, and nothing else, pass between modelling and numerics."""

from armblocks.equations.hybrid_system import HybridSystem, SampleClock, continuous_system
from armblocks.equations.options import SimulationOptions
from armblocks.equations.signature import (
    Shape,
    Signature,
    Slot,
    flatten,
    matrix_shape,
    signature,
    unflatten,
)
from armblocks.equations.traced_function import TracedFunction

__all__ = [
    "HybridSystem",
    "SampleClock",
    "Shape",
    "Signature",
    "SimulationOptions",
    "Slot",
    "TracedFunction",
    "continuous_system",
    "flatten",
    "matrix_shape",
    "signature",
    "unflatten",
]
