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
    from armblocks.face.collisions.check import collisions
    from armblocks.face.collisions.obstacles import Box, Cylinder, Plane, Sphere
    from armblocks.face.collisions.report import CollisionPair, CollisionReport
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
    from armblocks.face.excitation import Excitation, excitation
    from armblocks.face.fit import fit
    from armblocks.face.fit_data import Experiment
    from armblocks.face.fit_result import FitResult, FittedSignal
    from armblocks.face.identification_result import IdentificationResult
    from armblocks.face.identify import identify
    from armblocks.face.ikine_branches import IkineBranches
    from armblocks.face.ikine_result import IkineResult
    from armblocks.face.least_time import least_time
    from armblocks.face.linearizing import frequency_response, linearize
    from armblocks.face.model import CompiledDiagram, begin, compile_diagram, simulate
    from armblocks.face.motor_catalogue import load_drives
    from armblocks.face.optimise import optimise
    from armblocks.face.optimise_result import LocalSolution, OptimisationResult, OptimisedConstraint
    from armblocks.face.parametric import ParametricArm
    from armblocks.face.payload import Payload
    from armblocks.face.pick_and_place import CyclePhase, PickAndPlaceCycle, pick_and_place
    from armblocks.face.planned_trajectories import point_to_point, spline_trajectory
    from armblocks.face.reporting import draw_diagram, write_files, write_report
    from armblocks.face.robots import list_robots, load_robot, save_robot
    from armblocks.face.run_films import write_film
    from armblocks.face.sensitivity import SensitivityResult, sensitivity
    from armblocks.face.sizing import SizingReport, size_drives
    from armblocks.face.sweep import sweep
    from armblocks.face.sweep_result import SweepResult
    from armblocks.face.sweep_sensitivity import MorrisEffects, SobolIndices
    from armblocks.face.symbolic_arm import SymbolicArm, symbolic_dh
    from armblocks.face.symbolic_expression import SymbolicExpression
    from armblocks.face.toolbox_trajectories import ctraj, jtraj, lspb, mstraj, mtraj, tpoly
    from armblocks.face.trajectory import JointTrajectory
    from armblocks.face.trajectory_file import load_trajectory
    from armblocks.face.trajectory_report import BindingInterval, TrajectoryReport, trajectory_report
    from armblocks.face.trimming import trim
    from armblocks.face.workspace.capacity import payload_capacity
    from armblocks.face.workspace.cells import MeasureMap, WorkspaceSlice
    from armblocks.face.workspace.dexterity import dexterity
    from armblocks.face.workspace.result import Workspace
    from armblocks.face.workspace.sampling import workspace
    from armblocks.formats import load_table
    from armblocks.report.drive_load import Drive, DriveLoad
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
        JointSpring,
        LineSpring,
        Link,
        Motor,
        NamedFrame,
        Planar,
        PlanarClosure,
        PointOnLine,
        PointOnPlane,
        PrescribedMotion,
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
    from armblocks.sweeps.designs import Distribution, geomspace, linspace, loguniform, normal, seeds, uniform
    from armblocks.sweeps.measures import Measure
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Arm": "armblocks.face.arm",
            "Assembly": "armblocks.face.assembly",
            "Attachment": "armblocks.robot",
            "BindingInterval": "armblocks.face.trajectory_report",
            "Box": "armblocks.face.collisions.obstacles",
            "CollisionPair": "armblocks.face.collisions.report",
            "CollisionReport": "armblocks.face.collisions.report",
            "CompiledDiagram": "armblocks.face.model",
            "Coupling": "armblocks.robot",
            "CyclePhase": "armblocks.face.pick_and_place",
            "Cylinder": "armblocks.face.collisions.obstacles",
            "Cylindrical": "armblocks.robot",
            "CylindricalClosure": "armblocks.robot",
            "DhRow": "armblocks.robot",
            "Diagram": "armblocks.diagram",
            "DiagramBuilder": "armblocks.diagram",
            "DiagramDifference": "armblocks.diagram",
            "DiagramRun": "armblocks.face.diagram_run",
            "Distribution": "armblocks.sweeps.designs",
            "Drive": "armblocks.report.drive_load",
            "DriveLoad": "armblocks.report.drive_load",
            "Excitation": "armblocks.face.excitation",
            "Experiment": "armblocks.face.fit_data",
            "FitResult": "armblocks.face.fit_result",
            "FittedSignal": "armblocks.face.fit_result",
            "Fixed": "armblocks.robot",
            "Free": "armblocks.robot",
            "FrictionModel": "armblocks.robot",
            "IdentificationResult": "armblocks.face.identification_result",
            "IkineBranches": "armblocks.face.ikine_branches",
            "IkineResult": "armblocks.face.ikine_result",
            "JointLimits": "armblocks.robot",
            "JointSpring": "armblocks.robot",
            "JointTrajectory": "armblocks.face.trajectory",
            "LineSpring": "armblocks.robot",
            "LinearSystem": "armblocks.analysis.linear_system",
            "Link": "armblocks.robot",
            "LocalSolution": "armblocks.face.optimise_result",
            "Measure": "armblocks.sweeps.measures",
            "MeasureMap": "armblocks.face.workspace.cells",
            "MorrisEffects": "armblocks.face.sweep_sensitivity",
            "Motor": "armblocks.robot",
            "NamedFrame": "armblocks.robot",
            "OperatingPoint": "armblocks.analysis.operating_point",
            "OptimisationResult": "armblocks.face.optimise_result",
            "OptimisedConstraint": "armblocks.face.optimise_result",
            "ParametricArm": "armblocks.face.parametric",
            "Payload": "armblocks.face.payload",
            "PickAndPlaceCycle": "armblocks.face.pick_and_place",
            "Planar": "armblocks.robot",
            "PlanarClosure": "armblocks.robot",
            "Plane": "armblocks.face.collisions.obstacles",
            "PointOnLine": "armblocks.robot",
            "PointOnPlane": "armblocks.robot",
            "PrescribedMotion": "armblocks.robot",
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
            "SizingReport": "armblocks.face.sizing",
            "SobolIndices": "armblocks.face.sweep_sensitivity",
            "Sphere": "armblocks.face.collisions.obstacles",
            "Spherical": "armblocks.robot",
            "SphericalClosure": "armblocks.robot",
            "SweepResult": "armblocks.face.sweep_result",
            "SymbolicArm": "armblocks.face.symbolic_arm",
            "SymbolicExpression": "armblocks.face.symbolic_expression",
            "TrajectoryReport": "armblocks.face.trajectory_report",
            "Transform": "armblocks.spatial",
            "Universal": "armblocks.robot",
            "UniversalClosure": "armblocks.robot",
            "WeldClosure": "armblocks.robot",
            "Workspace": "armblocks.face.workspace.result",
            "WorkspaceSlice": "armblocks.face.workspace.cells",
            "begin": "armblocks.face.model",
            "block_example": "armblocks.face.block_examples",
            "blocks": "armblocks.blocks",
            "collisions": "armblocks.face.collisions.check",
            "compile_diagram": "armblocks.face.model",
            "ctraj": "armblocks.face.toolbox_trajectories",
            "dexterity": "armblocks.face.workspace.dexterity",
            "diagram_difference": "armblocks.diagram",
            "draw_diagram": "armblocks.face.reporting",
            "errors": "armblocks.errors",
            "excitation": "armblocks.face.excitation",
            "fit": "armblocks.face.fit",
            "formula": "armblocks.diagram",
            "frequency_response": "armblocks.face.linearizing",
            "geomspace": "armblocks.sweeps.designs",
            "identify": "armblocks.face.identify",
            "jtraj": "armblocks.face.toolbox_trajectories",
            "least_time": "armblocks.face.least_time",
            "linearize": "armblocks.face.linearizing",
            "linspace": "armblocks.sweeps.designs",
            "list_blocks": "armblocks.face.diagrams",
            "list_examples": "armblocks.face.diagrams",
            "list_libraries": "armblocks.face.diagrams",
            "list_robots": "armblocks.face.robots",
            "load_diagram": "armblocks.face.diagrams",
            "load_drives": "armblocks.face.motor_catalogue",
            "load_library": "armblocks.face.diagrams",
            "load_robot": "armblocks.face.robots",
            "load_table": "armblocks.formats",
            "load_trajectory": "armblocks.face.trajectory_file",
            "loguniform": "armblocks.sweeps.designs",
            "lspb": "armblocks.face.toolbox_trajectories",
            "modified_dh": "armblocks.robot",
            "mstraj": "armblocks.face.toolbox_trajectories",
            "mtraj": "armblocks.face.toolbox_trajectories",
            "normal": "armblocks.sweeps.designs",
            "optimise": "armblocks.face.optimise",
            "payload_capacity": "armblocks.face.workspace.capacity",
            "pick_and_place": "armblocks.face.pick_and_place",
            "point_to_point": "armblocks.face.planned_trajectories",
            "robot_widget": "armblocks.studio.notebook",
            "run_widget": "armblocks.studio.notebook",
            "save_diagram": "armblocks.face.diagrams",
            "save_library": "armblocks.face.diagrams",
            "save_robot": "armblocks.face.robots",
            "seeds": "armblocks.sweeps.designs",
            "sensitivity": "armblocks.face.sensitivity",
            "simulate": "armblocks.face.model",
            "size_drives": "armblocks.face.sizing",
            "spline_trajectory": "armblocks.face.planned_trajectories",
            "standard_dh": "armblocks.robot",
            "sweep": "armblocks.face.sweep",
            "symbolic_dh": "armblocks.face.symbolic_arm",
            "to_python": "armblocks.face.diagrams",
            "tpoly": "armblocks.face.toolbox_trajectories",
            "trajectory_report": "armblocks.face.trajectory_report",
            "trim": "armblocks.face.trimming",
            "uniform": "armblocks.sweeps.designs",
            "with_comments": "armblocks.diagram",
            "with_parameter_set": "armblocks.diagram",
            "workspace": "armblocks.face.workspace.sampling",
            "write_files": "armblocks.face.reporting",
            "write_film": "armblocks.face.run_films",
            "write_report": "armblocks.face.reporting",
        },
        argument_errors=True,
    )

__all__ = [
    "Arm",
    "Assembly",
    "Attachment",
    "BindingInterval",
    "Box",
    "CollisionPair",
    "CollisionReport",
    "CompiledDiagram",
    "Coupling",
    "CyclePhase",
    "Cylinder",
    "Cylindrical",
    "CylindricalClosure",
    "DhRow",
    "Diagram",
    "DiagramBuilder",
    "DiagramDifference",
    "DiagramRun",
    "Distribution",
    "Drive",
    "DriveLoad",
    "Excitation",
    "Experiment",
    "FitResult",
    "FittedSignal",
    "Fixed",
    "Free",
    "FrictionModel",
    "IdentificationResult",
    "IkineBranches",
    "IkineResult",
    "JointLimits",
    "JointSpring",
    "JointTrajectory",
    "LineSpring",
    "LinearSystem",
    "Link",
    "LocalSolution",
    "Measure",
    "MeasureMap",
    "MorrisEffects",
    "Motor",
    "NamedFrame",
    "OperatingPoint",
    "OptimisationResult",
    "OptimisedConstraint",
    "ParametricArm",
    "Payload",
    "PickAndPlaceCycle",
    "Planar",
    "PlanarClosure",
    "Plane",
    "PointOnLine",
    "PointOnPlane",
    "PrescribedMotion",
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
    "SizingReport",
    "SobolIndices",
    "Sphere",
    "Spherical",
    "SphericalClosure",
    "SweepResult",
    "SymbolicArm",
    "SymbolicExpression",
    "TrajectoryReport",
    "Transform",
    "Universal",
    "UniversalClosure",
    "WeldClosure",
    "Workspace",
    "WorkspaceSlice",
    "begin",
    "block_example",
    "blocks",
    "collisions",
    "compile_diagram",
    "ctraj",
    "dexterity",
    "diagram_difference",
    "draw_diagram",
    "errors",
    "excitation",
    "fit",
    "formula",
    "frequency_response",
    "geomspace",
    "identify",
    "jtraj",
    "least_time",
    "linearize",
    "linspace",
    "list_blocks",
    "list_examples",
    "list_libraries",
    "list_robots",
    "load_diagram",
    "load_drives",
    "load_library",
    "load_robot",
    "load_table",
    "load_trajectory",
    "loguniform",
    "lspb",
    "modified_dh",
    "mstraj",
    "mtraj",
    "normal",
    "optimise",
    "payload_capacity",
    "pick_and_place",
    "point_to_point",
    "robot_widget",
    "run_widget",
    "save_diagram",
    "save_library",
    "save_robot",
    "seeds",
    "sensitivity",
    "simulate",
    "size_drives",
    "spline_trajectory",
    "standard_dh",
    "sweep",
    "symbolic_dh",
    "to_python",
    "tpoly",
    "trajectory_report",
    "trim",
    "uniform",
    "with_comments",
    "with_parameter_set",
    "workspace",
    "write_files",
    "write_film",
    "write_report",
]


def __dir__() -> list[str]:
    return __all__
