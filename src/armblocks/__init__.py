"""Industrial arms and block diagrams, traced once and compiled to native code.

>>> import armblocks as ab
>>> arm = ab.load_robot("kr180")
>>> result = ab.simulate("kr180model")
"""

from typing import TYPE_CHECKING

from armblocks.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from armblocks import blocks, errors
    from armblocks.analysis.linear_system import LinearSystem
    from armblocks.analysis.operating_point import OperatingPoint
    from armblocks.diagram import (
        Diagram,
        DiagramBuilder,
        DiagramDifference,
        diagram_difference,
        formula,
        with_comments,
        with_parameter_set,
    )
    from armblocks.equations import SimulationOptions
    from armblocks.face.arm import Arm
    from armblocks.face.assembly import Assembly
    from armblocks.face.block_examples import block_example
    from armblocks.face.diagram_run import DiagramRun
    from armblocks.face.diagrams import (
        list_blocks,
        list_examples,
        list_libraries,
        load_diagram,
        load_library,
        save_diagram,
        save_library,
        to_python,
    )
    from armblocks.face.linearizing import frequency_response, linearize
    from armblocks.face.model import CompiledDiagram, begin, compile_diagram, simulate
    from armblocks.face.payload import Payload
    from armblocks.face.reporting import draw_diagram, write_files, write_report
    from armblocks.face.robots import list_robots, load_robot, save_robot
    from armblocks.face.sensitivity import SensitivityResult, sensitivity
    from armblocks.face.trajectory import JointTrajectory, jtraj
    from armblocks.face.trimming import trim
    from armblocks.formats import load_table
    from armblocks.robot import (
        Attachment,
        Coupling,
        Cylindrical,
        CylindricalClosure,
        DhRow,
        Fixed,
        Free,
        FrictionModel,
        JointLimits,
        Link,
        Motor,
        Planar,
        PlanarClosure,
        PointOnLine,
        PointOnPlane,
        Prismatic,
        PrismaticClosure,
        Revolute,
        RevoluteClosure,
        Robot,
        Rod,
        Screw,
        Spherical,
        SphericalClosure,
        Universal,
        UniversalClosure,
        WeldClosure,
        modified_dh,
        standard_dh,
    )
    from armblocks.simulation import SimulationResult
    from armblocks.spatial import Transform
    from armblocks.studio.notebook import robot_widget, run_widget
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Arm": "armblocks.face.arm",
            "Assembly": "armblocks.face.assembly",
            "Attachment": "armblocks.robot",
            "CompiledDiagram": "armblocks.face.model",
            "Coupling": "armblocks.robot",
            "Cylindrical": "armblocks.robot",
            "CylindricalClosure": "armblocks.robot",
            "DhRow": "armblocks.robot",
            "Diagram": "armblocks.diagram",
            "DiagramBuilder": "armblocks.diagram",
            "DiagramDifference": "armblocks.diagram",
            "DiagramRun": "armblocks.face.diagram_run",
            "Fixed": "armblocks.robot",
            "Free": "armblocks.robot",
            "FrictionModel": "armblocks.robot",
            "JointLimits": "armblocks.robot",
            "JointTrajectory": "armblocks.face.trajectory",
            "LinearSystem": "armblocks.analysis.linear_system",
            "Link": "armblocks.robot",
            "Motor": "armblocks.robot",
            "OperatingPoint": "armblocks.analysis.operating_point",
            "Payload": "armblocks.face.payload",
            "Planar": "armblocks.robot",
            "PlanarClosure": "armblocks.robot",
            "PointOnLine": "armblocks.robot",
            "PointOnPlane": "armblocks.robot",
            "Prismatic": "armblocks.robot",
            "PrismaticClosure": "armblocks.robot",
            "Revolute": "armblocks.robot",
            "RevoluteClosure": "armblocks.robot",
            "Robot": "armblocks.robot",
            "Rod": "armblocks.robot",
            "Screw": "armblocks.robot",
            "SensitivityResult": "armblocks.face.sensitivity",
            "SimulationOptions": "armblocks.equations",
            "SimulationResult": "armblocks.simulation",
            "Spherical": "armblocks.robot",
            "SphericalClosure": "armblocks.robot",
            "Transform": "armblocks.spatial",
            "Universal": "armblocks.robot",
            "UniversalClosure": "armblocks.robot",
            "WeldClosure": "armblocks.robot",
            "begin": "armblocks.face.model",
            "block_example": "armblocks.face.block_examples",
            "blocks": "armblocks.blocks",
            "compile_diagram": "armblocks.face.model",
            "diagram_difference": "armblocks.diagram",
            "draw_diagram": "armblocks.face.reporting",
            "errors": "armblocks.errors",
            "formula": "armblocks.diagram",
            "frequency_response": "armblocks.face.linearizing",
            "jtraj": "armblocks.face.trajectory",
            "linearize": "armblocks.face.linearizing",
            "list_blocks": "armblocks.face.diagrams",
            "list_examples": "armblocks.face.diagrams",
            "list_libraries": "armblocks.face.diagrams",
            "list_robots": "armblocks.face.robots",
            "load_diagram": "armblocks.face.diagrams",
            "load_library": "armblocks.face.diagrams",
            "load_robot": "armblocks.face.robots",
            "load_table": "armblocks.formats",
            "modified_dh": "armblocks.robot",
            "robot_widget": "armblocks.studio.notebook",
            "run_widget": "armblocks.studio.notebook",
            "save_diagram": "armblocks.face.diagrams",
            "save_library": "armblocks.face.diagrams",
            "save_robot": "armblocks.face.robots",
            "sensitivity": "armblocks.face.sensitivity",
            "simulate": "armblocks.face.model",
            "standard_dh": "armblocks.robot",
            "to_python": "armblocks.face.diagrams",
            "trim": "armblocks.face.trimming",
            "with_comments": "armblocks.diagram",
            "with_parameter_set": "armblocks.diagram",
            "write_files": "armblocks.face.reporting",
            "write_report": "armblocks.face.reporting",
        },
        argument_errors=True,
    )

__all__ = [
    "Arm",
    "Assembly",
    "Attachment",
    "CompiledDiagram",
    "Coupling",
    "Cylindrical",
    "CylindricalClosure",
    "DhRow",
    "Diagram",
    "DiagramBuilder",
    "DiagramDifference",
    "DiagramRun",
    "Fixed",
    "Free",
    "FrictionModel",
    "JointLimits",
    "JointTrajectory",
    "LinearSystem",
    "Link",
    "Motor",
    "OperatingPoint",
    "Payload",
    "Planar",
    "PlanarClosure",
    "PointOnLine",
    "PointOnPlane",
    "Prismatic",
    "PrismaticClosure",
    "Revolute",
    "RevoluteClosure",
    "Robot",
    "Rod",
    "Screw",
    "SensitivityResult",
    "SimulationOptions",
    "SimulationResult",
    "Spherical",
    "SphericalClosure",
    "Transform",
    "Universal",
    "UniversalClosure",
    "WeldClosure",
    "begin",
    "block_example",
    "blocks",
    "compile_diagram",
    "diagram_difference",
    "draw_diagram",
    "errors",
    "formula",
    "frequency_response",
    "jtraj",
    "linearize",
    "list_blocks",
    "list_examples",
    "list_libraries",
    "list_robots",
    "load_diagram",
    "load_library",
    "load_robot",
    "load_table",
    "modified_dh",
    "robot_widget",
    "run_widget",
    "save_diagram",
    "save_library",
    "save_robot",
    "sensitivity",
    "simulate",
    "standard_dh",
    "to_python",
    "trim",
    "with_comments",
    "with_parameter_set",
    "write_files",
    "write_report",
]


def __dir__() -> list[str]:
    return __all__
