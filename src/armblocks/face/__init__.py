"""The public Python face: what users type. Everything here is re-exported by ``armblocks``."""

from armblocks.face.arm import Arm
from armblocks.face.loading import (
    list_blocks,
    list_examples,
    list_robots,
    load_diagram,
    load_robot,
    save_diagram,
    save_robot,
)
from armblocks.face.model import CompiledDiagram, compile_diagram, simulate
from armblocks.face.payload import Payload
from armblocks.face.reporting import write_report
from armblocks.face.trajectory import JointTrajectory, jtraj

__all__ = [
    "Arm",
    "CompiledDiagram",
    "JointTrajectory",
    "Payload",
    "compile_diagram",
    "jtraj",
    "list_blocks",
    "list_examples",
    "list_robots",
    "load_diagram",
    "load_robot",
    "save_diagram",
    "save_robot",
    "simulate",
    "write_report",
]
