"""All kinds of blocks, by family. ``BLOCKS`` is the library of every class that a family's file defines."""

from types import ModuleType

from armblocks.blocks import continuous, maths, robots, routing, sinks, sources, transforms
from armblocks.blocks.continuous import PID, Derivative, Integrator, StateSpace, TransferFunction
from armblocks.blocks.maths import (
    Atan2,
    Gain,
    MathFunction,
    MatrixGain,
    MatrixProduct,
    MinMax,
    Power,
    Product,
    Saturation,
    Sum,
    Trigonometry,
)
from armblocks.blocks.robots import (
    Coriolis,
    Fkine,
    ForwardDynamics,
    Gravload,
    Inertia,
    Jacob0,
    Jacobe,
    JTraj,
    Rne,
    RobotPlot,
)
from armblocks.blocks.routing import Demux, Mux
from armblocks.blocks.sinks import Display, Scope, Terminator, ToWorkspace, XYGraph
from armblocks.blocks.sources import Clock, Constant, Ramp, SineWave, Step
from armblocks.blocks.transforms import T2xyz, Xyz2T
from armblocks.diagram import Block, BlockLibrary


def _defined_in(family: ModuleType) -> list[type[Block]]:
    kinds = [value for value in vars(family).values() if isinstance(value, type) and issubclass(value, Block)]
    return [kind for kind in kinds if kind.__module__ == family.__name__]


BLOCKS = BlockLibrary(
    kind
    for family in (sources, maths, continuous, routing, transforms, robots, sinks)
    for kind in _defined_in(family)
)
"""Every kind of block by type name."""

__all__ = [
    "BLOCKS",
    "PID",
    "Atan2",
    "Clock",
    "Constant",
    "Coriolis",
    "Demux",
    "Derivative",
    "Display",
    "Fkine",
    "ForwardDynamics",
    "Gain",
    "Gravload",
    "Inertia",
    "Integrator",
    "JTraj",
    "Jacob0",
    "Jacobe",
    "MathFunction",
    "MatrixGain",
    "MatrixProduct",
    "MinMax",
    "Mux",
    "Power",
    "Product",
    "Ramp",
    "Rne",
    "RobotPlot",
    "Saturation",
    "Scope",
    "SineWave",
    "StateSpace",
    "Step",
    "Sum",
    "T2xyz",
    "Terminator",
    "ToWorkspace",
    "TransferFunction",
    "Trigonometry",
    "XYGraph",
    "Xyz2T",
]
