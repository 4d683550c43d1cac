"""Typed sets of equations: the interface between modelling and numerics."""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks.equations.constant_folding import (
        call_with_constants,
        elementary,
        has_elementary,
        substituted,
    )
    from armblocks.equations.continuous import continuous_system
    from armblocks.equations.flow_jacobian import FlowJacobian, trace_flow_jacobian
    from armblocks.equations.forward_differentiation import directional_derivative
    from armblocks.equations.hybrid_system import (
        Delays,
        EventRanks,
        HybridSystem,
        LinearLoops,
        SampleClock,
    )
    from armblocks.equations.options import SimulationOptions
    from armblocks.equations.signatures import Shape, Signature, Slot, signature
    from armblocks.equations.symbols import flatten, matrix_shape, unflatten
    from armblocks.equations.table_reading import last_at_or_below, read_entry
    from armblocks.equations.traced_function import TracedFunction
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "FlowJacobian": "armblocks.equations.flow_jacobian",
            "Delays": "armblocks.equations.hybrid_system",
            "HybridSystem": "armblocks.equations.hybrid_system",
            "EventRanks": "armblocks.equations.hybrid_system",
            "LinearLoops": "armblocks.equations.hybrid_system",
            "SampleClock": "armblocks.equations.hybrid_system",
            "Shape": "armblocks.equations.signatures",
            "Signature": "armblocks.equations.signatures",
            "SimulationOptions": "armblocks.equations.options",
            "Slot": "armblocks.equations.signatures",
            "TracedFunction": "armblocks.equations.traced_function",
            "call_with_constants": "armblocks.equations.constant_folding",
            "continuous_system": "armblocks.equations.continuous",
            "directional_derivative": "armblocks.equations.forward_differentiation",
            "elementary": "armblocks.equations.constant_folding",
            "flatten": "armblocks.equations.symbols",
            "has_elementary": "armblocks.equations.constant_folding",
            "last_at_or_below": "armblocks.equations.table_reading",
            "matrix_shape": "armblocks.equations.symbols",
            "read_entry": "armblocks.equations.table_reading",
            "signature": "armblocks.equations.signatures",
            "substituted": "armblocks.equations.constant_folding",
            "trace_flow_jacobian": "armblocks.equations.flow_jacobian",
            "unflatten": "armblocks.equations.symbols",
        },
    )

__all__ = [
    "Delays",
    "EventRanks",
    "FlowJacobian",
    "HybridSystem",
    "LinearLoops",
    "SampleClock",
    "Shape",
    "Signature",
    "SimulationOptions",
    "Slot",
    "TracedFunction",
    "call_with_constants",
    "continuous_system",
    "directional_derivative",
    "elementary",
    "flatten",
    "has_elementary",
    "last_at_or_below",
    "matrix_shape",
    "read_entry",
    "signature",
    "substituted",
    "trace_flow_jacobian",
    "unflatten",
]
