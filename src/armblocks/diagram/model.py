"""Analysis of a diagram before tracing: shapes, clocks, and the order of evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

from armblocks.diagram.block_equations import (
    BlockEquations,
    block_equations,
    known_equations,
)
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.event_order import EventOrder, event_order
from armblocks.diagram.hierarchy import flatten_hierarchy
from armblocks.diagram.ordering import Evaluation, Network, evaluation_order
from armblocks.diagram.sampling import Sampling, check_triggered, moving_blocks, resolve_sampling
from armblocks.diagram.shapes import DiagramShapes, check_declared_shapes, infer_shapes
from armblocks.diagram.sums_on_loops import sums_on_loops
from armblocks.errors import ArmblocksError, DiagramError


@dataclass(frozen=True)
class Model:
    """The results of the analysis: shapes, clocks, and the order of evaluation, in the flow and at ticks."""

    shapes: DiagramShapes
    sampling: Sampling
    flow: Network
    flow_order: Evaluation
    tick: Network
    tick_order: Evaluation

    @cached_property
    def events(self) -> EventOrder | None:
        """The order of events and ticks at one instant; ``None`` if all events are processed together."""
        return event_order(self.flow)


def check_model(diagram: Diagram) -> None:
    """Raise the errors of :func:`diagram_model`, without tracing blocks whose dependences are known.

    The known dependences of an output may include inputs that its equations do not contain. After an error,
    or if there is a loop, the diagram is therefore analysed with all equations.
    """
    flat = flatten_hierarchy(diagram).diagram
    if any(block.known_dependences() is not None for block in flat.blocks.values()):
        with suppress(ArmblocksError):
            model = diagram_model(diagram, traced=False)
            if not model.flow_order.loops and not model.tick_order.loops:
                return
    diagram_model(diagram)


def diagram_model(diagram: Diagram, *, traced: bool = True) -> Model:
    """Analyse the flat form of a diagram; ``traced``: whether blocks with known dependences are traced.

    Raises ``DiagramError`` for unconnected inputs, for shapes and sample times that do not fit, and for
    blocks whose parameters allow no equations (a robot without mass). Raises ``AlgebraicLoopError`` for loops
    without an evaluation order.
    """
    shapes = infer_shapes(diagram)
    form = flatten_hierarchy(diagram)
    diagram = form.diagram
    check_declared_shapes(form, shapes)
    free = [name for name in diagram.blocks if not diagram.clocked(name)]
    known = {} if traced else _known_equations(diagram, free, shapes)
    equations = {name: known.get(name) or _equations(diagram, name, shapes) for name in free}
    check_triggered(diagram, equations)
    sampling = resolve_sampling(diagram, equations)
    moving = moving_blocks(diagram, equations)
    for name in free:
        # Conditions that change only at instants need no events. Their blocks then depend on more inputs;
        # without all equations it is not known which blocks these are.
        constant = (name not in moving or not traced) and name not in diagram.gates
        features = equations[name].features
        if constant and features.conditions and not features.states:
            equations[name] = _equations(diagram, name, shapes, consistent_modes=not features.modes)
    for name, clock in sampling.clock_of.items():
        period = sampling.clocks[clock].period
        equations[name] = _equations(diagram, name, shapes, period=period)
    equations = {name: equations[name] for name in diagram.blocks}
    flow, tick = Network(diagram, equations), Network(diagram, equations, ticking=True)
    if sampling.clocks:
        consistent = {
            name: known.get(name) or _equations(diagram, name, shapes, consistent_modes=True) for name in free
        }
        for name, clock in sampling.clock_of.items():
            period = sampling.clocks[clock].period
            consistent[name] = _equations(diagram, name, shapes, period=period, consistent_modes=True)
        tick = Network(diagram, equations | consistent, ticking=True)
    return Model(
        shapes=shapes,
        sampling=sampling,
        flow=flow,
        flow_order=_order(flow) if traced else evaluation_order(flow),
        tick=tick,
        tick_order=_order(tick) if traced else evaluation_order(tick),
    )


def _order(network: Network) -> Evaluation:
    """The order of evaluation, with loops that are linear cut at their sums."""
    order = evaluation_order(network)
    sums = sums_on_loops(network, order)
    return evaluation_order(network, sums) if sums else order


def _known_equations(
    diagram: Diagram, names: Sequence[str], shapes: DiagramShapes
) -> dict[str, BlockEquations]:
    """The equations without expressions of the blocks whose dependences are known."""
    found: dict[str, BlockEquations] = {}
    for name in names:
        dependences = diagram.blocks[name].known_dependences()
        if dependences is not None and not diagram.gates.get(name):
            found[name] = known_equations(diagram.blocks[name], shapes.inputs[name], dependences)
    return found


def _equations(
    diagram: Diagram, name: str, shapes: DiagramShapes, *, period: float = 1.0, consistent_modes: bool = False
) -> BlockEquations:
    block, hidden = diagram.blocks[name], diagram.gates.get(name, {})
    try:
        return block_equations(
            block, shapes.inputs[name], period=period, consistent_modes=consistent_modes, hidden=hidden
        )
    except DiagramError:
        raise
    except ArmblocksError as error:
        where = ", ".join(filter(None, (f"block '{name}' ({block.title})", error.where)))
        raise DiagramError(error.what, where=where, allowed=error.allowed, fix=error.fix) from error


def sampling_of(diagram: Diagram) -> Sampling:
    """The clocks of a diagram, and the clock of each sampled block of its flat form.

    Raises ``DiagramError`` for a diagram that cannot be traced.
    """
    return diagram.cached("sampling", lambda: diagram_model(diagram).sampling)
