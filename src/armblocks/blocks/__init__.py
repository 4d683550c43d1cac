"""All kinds of blocks, by family. ``BLOCKS`` is the library of every class that a family's file defines."""

from types import ModuleType

from armblocks.blocks import (
    arithmetic,
    continuous,
    logic,
    maths,
    matrices,
    reductions,
    robots,
    routing,
    selection,
    sinks,
    sources,
    transforms,
)
from armblocks.blocks.arithmetic import (
    Abs,
    AngleDifference,
    Bias,
    CartesianToPolar,
    DegreesToRadians,
    Divide,
    Hypot,
    Modulo,
    PolarToCartesian,
    Polynomial,
    RadiansToDegrees,
    Rounding,
    Sign,
    Sqrt,
    UnaryMinus,
)
from armblocks.blocks.continuous import PID, Derivative, Integrator, StateSpace, TransferFunction
from armblocks.blocks.logic import (
    CombinatorialLogic,
    CompareToConstant,
    CompareToZero,
    IntervalTest,
    IntervalTestDynamic,
    LogicalOperator,
    RelationalOperator,
)
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
from armblocks.blocks.matrices import (
    CrossProduct,
    Determinant,
    DiagonalMatrix,
    ExtractDiagonal,
    LinearSolve,
    MatrixConcatenate,
    MatrixInverse,
    MatrixPower,
    Reshape,
    Trace,
    Transpose,
)
from armblocks.blocks.reductions import (
    CumulativeSum,
    DotProduct,
    Extremum,
    Norm,
    ProductOfElements,
    SumOfElements,
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
from armblocks.blocks.selection import (
    Assignment,
    IndexVector,
    ManualSwitch,
    MultiportSwitch,
    Selector,
    SubMatrix,
)
from armblocks.blocks.sinks import Display, Scope, Terminator, ToWorkspace, XYGraph
from armblocks.blocks.sources import Clock, Constant, Ramp, SineWave, Step
from armblocks.blocks.transforms import T2xyz, Xyz2T
from armblocks.diagram import Block, BlockLibrary


def _defined_in(family: ModuleType) -> list[type[Block]]:
    kinds = [value for value in vars(family).values() if isinstance(value, type) and issubclass(value, Block)]
    return [kind for kind in kinds if kind.__module__ == family.__name__]


BLOCKS = BlockLibrary(
    kind
    for family in (
        sources,
        maths,
        continuous,
        routing,
        transforms,
        robots,
        sinks,
        arithmetic,
        reductions,
        matrices,
        selection,
        logic,
    )
    for kind in _defined_in(family)
)
"""Every kind of block by type name."""

__all__ = [
    "BLOCKS",
    "PID",
    "Abs",
    "AngleDifference",
    "Assignment",
    "Atan2",
    "Bias",
    "CartesianToPolar",
    "Clock",
    "CombinatorialLogic",
    "CompareToConstant",
    "CompareToZero",
    "Constant",
    "Coriolis",
    "CrossProduct",
    "CumulativeSum",
    "DegreesToRadians",
    "Demux",
    "Derivative",
    "Determinant",
    "DiagonalMatrix",
    "Display",
    "Divide",
    "DotProduct",
    "ExtractDiagonal",
    "Extremum",
    "Fkine",
    "ForwardDynamics",
    "Gain",
    "Gravload",
    "Hypot",
    "IndexVector",
    "Inertia",
    "Integrator",
    "IntervalTest",
    "IntervalTestDynamic",
    "JTraj",
    "Jacob0",
    "Jacobe",
    "LinearSolve",
    "LogicalOperator",
    "ManualSwitch",
    "MathFunction",
    "MatrixConcatenate",
    "MatrixGain",
    "MatrixInverse",
    "MatrixPower",
    "MatrixProduct",
    "MinMax",
    "Modulo",
    "MultiportSwitch",
    "Mux",
    "Norm",
    "PolarToCartesian",
    "Polynomial",
    "Power",
    "Product",
    "ProductOfElements",
    "RadiansToDegrees",
    "Ramp",
    "RelationalOperator",
    "Reshape",
    "Rne",
    "RobotPlot",
    "Rounding",
    "Saturation",
    "Scope",
    "Selector",
    "Sign",
    "SineWave",
    "Sqrt",
    "StateSpace",
    "Step",
    "SubMatrix",
    "Sum",
    "SumOfElements",
    "T2xyz",
    "Terminator",
    "ToWorkspace",
    "Trace",
    "TransferFunction",
    "Transpose",
    "Trigonometry",
    "UnaryMinus",
    "XYGraph",
    "Xyz2T",
]
