"""Diagrams: blocks, connections, checks, and the translation into equations."""

from armblocks.diagram.block import Block, Shapes, Signals
from armblocks.diagram.block_equations import BlockEquations, block_equations
from armblocks.diagram.bookmarks import Bookmark
from armblocks.diagram.builder import BlockHandle, DiagramBuilder
from armblocks.diagram.bus import Bus, PortContent
from armblocks.diagram.check import check_diagram
from armblocks.diagram.comments import Comment, check_comment, commented_paths, is_inside, open_inputs
from armblocks.diagram.conditional import (
    ActionSubsystem,
    EnabledSubsystem,
    EnabledTriggeredSubsystem,
    Merge,
    ResettableSubsystem,
    TriggeredSubsystem,
)
from armblocks.diagram.connection_port import ConnectionPort
from armblocks.diagram.content_key import content_key
from armblocks.diagram.diagram import (
    BLOCK_COLOURS,
    NAME_SIDES,
    ROTATIONS,
    Connection,
    Diagram,
    Note,
    Placement,
)
from armblocks.diagram.difference import DiagramDifference, diagram_difference
from armblocks.diagram.features import SlotKind
from armblocks.diagram.frames import FrameLine, FramePort, frames_of, lines_without
from armblocks.diagram.hierarchy import (
    FlatForm,
    diagram_views,
    flat_diagram,
    flatten_hierarchy,
)
from armblocks.diagram.levels import levels_of
from armblocks.diagram.library import BlockLibrary, UnimportedBlock
from armblocks.diagram.mask import ParameterFormula, formula, mask_parameter
from armblocks.diagram.model import sampling_of
from armblocks.diagram.names import check_block_name
from armblocks.diagram.parameter import REQUIRED, Parameter, ParameterKind, parameter, shape_of
from armblocks.diagram.parameter_sets import with_parameter_set
from armblocks.diagram.port import (
    Condition,
    DelayLine,
    FileSettings,
    Guard,
    Port,
    PortRef,
    SpectrumSettings,
    State,
    View,
    ViewKind,
)
from armblocks.diagram.sampling import sample_time_parameter
from armblocks.diagram.scope_trigger import ScopeTrigger
from armblocks.diagram.shape_rules import broadcast
from armblocks.diagram.shapes import DiagramShapes, infer_shapes
from armblocks.diagram.structure import (
    DiagramBlock,
    Inport,
    Outport,
    Subsystem,
    block_count,
    check_block_count,
)
from armblocks.diagram.time_table import TimeTable
from armblocks.diagram.trace import trace_diagram
from armblocks.diagram.units import infer_units, integral_unit, rate_unit
from armblocks.diagram.user_function import UserFunction
from armblocks.diagram.variation import with_comments, with_parameters
from armblocks.diagram.virtual_wiring import BusAssignment, BusCreator, BusSelector, From, Goto
from armblocks.diagram.worked_example import Driver, ExampleBlock, WorkedExample, driver

__all__ = [
    "BLOCK_COLOURS",
    "NAME_SIDES",
    "REQUIRED",
    "ROTATIONS",
    "ActionSubsystem",
    "Block",
    "BlockEquations",
    "BlockHandle",
    "BlockLibrary",
    "Bookmark",
    "Bus",
    "BusAssignment",
    "BusCreator",
    "BusSelector",
    "Comment",
    "Condition",
    "Connection",
    "ConnectionPort",
    "DelayLine",
    "Diagram",
    "DiagramBlock",
    "DiagramBuilder",
    "DiagramDifference",
    "DiagramShapes",
    "Driver",
    "EnabledSubsystem",
    "EnabledTriggeredSubsystem",
    "ExampleBlock",
    "FileSettings",
    "FlatForm",
    "FrameLine",
    "FramePort",
    "From",
    "Goto",
    "Guard",
    "Inport",
    "Merge",
    "Note",
    "Outport",
    "Parameter",
    "ParameterFormula",
    "ParameterKind",
    "Placement",
    "Port",
    "PortContent",
    "PortRef",
    "ResettableSubsystem",
    "ScopeTrigger",
    "Shapes",
    "Signals",
    "SlotKind",
    "SpectrumSettings",
    "State",
    "Subsystem",
    "TimeTable",
    "TriggeredSubsystem",
    "UnimportedBlock",
    "UserFunction",
    "View",
    "ViewKind",
    "WorkedExample",
    "block_count",
    "block_equations",
    "broadcast",
    "check_block_count",
    "check_block_name",
    "check_comment",
    "check_diagram",
    "commented_paths",
    "content_key",
    "diagram_difference",
    "diagram_views",
    "driver",
    "flat_diagram",
    "flatten_hierarchy",
    "formula",
    "frames_of",
    "infer_shapes",
    "infer_units",
    "integral_unit",
    "is_inside",
    "levels_of",
    "lines_without",
    "mask_parameter",
    "open_inputs",
    "parameter",
    "rate_unit",
    "sample_time_parameter",
    "sampling_of",
    "shape_of",
    "trace_diagram",
    "with_comments",
    "with_parameter_set",
    "with_parameters",
]
