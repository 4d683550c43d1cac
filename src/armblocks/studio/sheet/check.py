"""Checks of an incomplete diagram; the findings refer to blocks and ports and do not prevent edits."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

from armblocks.diagram import Bus, Diagram, PortRef, flatten_hierarchy, infer_shapes, infer_units, open_inputs
from armblocks.diagram.check import check_diagram
from armblocks.diagram.levels import joined, levels_of
from armblocks.diagram.parameter_sets import check_parameter_sets
from armblocks.errors import AlgebraicLoopError, ArmblocksError, DiagramError
from armblocks.multibody.drawn_robots import drawn_robots
from armblocks.studio.protocol.messages.sheets import Finding, WireKind

_QUOTED = re.compile(r"block '([^']+)'")


def check(diagram: Diagram) -> tuple[list[Finding], dict[str, WireKind]]:
    """Return the findings, and type and shape of each output signal as far as they can be determined."""
    try:
        levels = levels_of(diagram)
    except DiagramError as error:
        return _findings(error, (), {}), {}
    if unconnected := list(open_inputs(levels)):
        # Shapes and loops can be checked only when every input has a driver.
        warnings = [_open_input(ref.block, ref.port) for ref in unconnected]
        return [*_assembly_faults(diagram, levels), *warnings], {}
    block_paths = [joined(path, name) for path, level in levels.items() for name in level.blocks]
    try:
        wires = _wires(diagram)
        check_diagram(diagram)
        check_parameter_sets(diagram)
    except ArmblocksError as error:
        return _findings(error, block_paths, _origins(diagram)), {}
    return [], wires


def _assembly_faults(diagram: Diagram, levels: Mapping[str, Diagram]) -> list[Finding]:
    """Return the faults of mechanisms with a World Frame, at physical blocks, in a diagram with open inputs.

    Other errors are not faults of a mechanism: they may follow from the unconnected inputs.
    """
    in_mechanisms = [
        joined(path, name)
        for path, level in levels.items()
        for name, block in level.blocks.items()
        if type(block).gathers is not None
    ]
    if not in_mechanisms:
        return []
    try:
        drawn_robots(diagram)
    except ArmblocksError as error:
        return [finding for finding in _findings(error, in_mechanisms, {}) if finding.block]
    return []


def _open_input(block: str, port: str) -> Finding:
    """Return a warning: inputs are unconnected while a model is built, and only a run is refused."""
    return Finding(
        severity="warning",
        block=block,
        port=port,
        what=f"the input '{port}' is not connected",
        fix="draw a wire to it, or drop a Constant or a Ground beside it",
    )


def _wires(diagram: Diagram) -> dict[str, WireKind]:
    form = flatten_hierarchy(diagram)
    shapes, units = infer_shapes(diagram).outputs, infer_units(diagram)
    kinds = {
        PortRef(name, port): WireKind(shape=list(shape), unit=units.get(PortRef(name, port), ""))
        for name, outputs in shapes.items()
        for port, shape in outputs.items()
    }
    kinds_by_port = {str(ref): kind for ref, kind in kinds.items()}
    for port, content in form.contents.items():
        if isinstance(content, Bus):
            kinds_by_port[str(port)] = WireKind(shape=[], unit="", bus=True)
        elif content in kinds:
            kinds_by_port[str(port)] = kinds[content]
    return kinds_by_port


def _origins(diagram: Diagram) -> Mapping[str, str]:
    """Map the blocks that flattening adds to the blocks of the sheet; empty if flattening fails."""
    try:
        return flatten_hierarchy(diagram).origins
    except ArmblocksError:
        return {}


def _findings(error: ArmblocksError, known: Collection[str], origins: Mapping[str, str]) -> list[Finding]:
    """Return one finding for every block that the message names, so that each block can be marked.

    Copies of a block for the signals of a bus, and control blocks of conditional subsystems, are mapped to
    the block of the sheet from which they were created.
    """
    blocks: list[str] = []
    if isinstance(error, AlgebraicLoopError):
        blocks = [ref.rpartition("/")[0] for ref in error.loop]
    elif isinstance(error, DiagramError):
        blocks = _QUOTED.findall(f"{error.where} {error.what}")
    shown_blocks = dict.fromkeys(origins.get(name, name) for name in blocks)
    marked = [name for name in shown_blocks if name in known] or [""]
    return [Finding(severity="error", block=name, port="", what=error.what, fix=error.fix) for name in marked]
