"""Industrial arms and block diagrams, traced once and compiled to native code.

>>> import armblocks as ab
>>> arm = ab.load_robot("kr180")
>>> result = ab.simulate("kr180model")
"""

from armblocks import blocks, errors
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.face import (
    Arm,
    CompiledDiagram,
    JointTrajectory,
    Payload,
    compile_diagram,
    jtraj,
    list_blocks,
    list_examples,
    list_robots,
    load_diagram,
    load_robot,
    save_diagram,
    save_robot,
    simulate,
    write_report,
)
from armblocks.robot import (
    DhRow,
    Fixed,
    FrictionModel,
    JointLimits,
    Link,
    Motor,
    Prismatic,
    Revolute,
    Robot,
    modified_dh,
    standard_dh,
)
from armblocks.simulation import SimulationResult
from armblocks.spatial import Transform

__all__ = [
    "Arm",
    "CompiledDiagram",
    "DhRow",
    "Diagram",
    "DiagramBuilder",
    "Fixed",
    "FrictionModel",
    "JointLimits",
    "JointTrajectory",
    "Link",
    "Motor",
    "Payload",
    "Prismatic",
    "Revolute",
    "Robot",
    "SimulationOptions",
    "SimulationResult",
    "Transform",
    "blocks",
    "compile_diagram",
    "errors",
    "jtraj",
    "list_blocks",
    "list_examples",
    "list_robots",
    "load_diagram",
    "load_robot",
    "modified_dh",
    "save_diagram",
    "save_robot",
    "simulate",
    "standard_dh",
    "write_report",
]
