"""Tracing: a checked diagram becomes one set of equations, the only input of the numerics."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from casadi import (
    SX,
    densify,
    depends_on,
    dot,
    fabs,
    if_else,
    jacobian,
    logic_or,
    substitute,
    vertcat,
)

from armblocks.diagram.block_equations import BlockSlot
from armblocks.diagram.conditional_equations import FIRE, ON
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.features import AT_TICKS, SlotKind
from armblocks.diagram.flat_values import broadcast_column
from armblocks.diagram.guards_and_modes import (
    disabled_guards,
    event_ranks,
    guards_of,
    hysteresis_modes,
    mode_contradictions,
    momentary_states,
    recaptured_states,
)
from armblocks.diagram.hierarchy import FlatForm, flatten_hierarchy
from armblocks.diagram.implicit import solve_affine
from armblocks.diagram.model import Model, diagram_model
from armblocks.diagram.ordering import HELD, Network, Node, Value
from armblocks.diagram.port import PortRef
from armblocks.diagram.shapes import DiagramShapes
from armblocks.diagram.signal_names import named_signals
from armblocks.diagram.structure import Outport
from armblocks.diagram.tracing import Implicit, Symbols, Tracing
from armblocks.diagram.units import infer_units
from armblocks.equations import (
    Delays,
    HybridSystem,
    LinearLoops,
    Signature,
    Slot,
    TracedFunction,
    flatten,
    signature,
    substituted,
)
from armblocks.errors import DiagramError


def trace_diagram(diagram: Diagram) -> HybridSystem:
    """All equations of a diagram: see :class:`armblocks.equations.HybridSystem`.

    Two passes in evaluation order, one for the flow and one for the ticks: each group of each block is
    evaluated once, from values that are already available. A Derivative block's output is the exact time
    derivative of its input, computed group by group by the chain rule. Equations give the derivatives of
    states. Jumps of the input are ignored. Algebraic loops are cut. Linear loops are solved here; of
    every other loop, an unknown and a residual remain for the solver.

    Raises ``DiagramError`` or ``AlgebraicLoopError``; for a diagram from a builder, only for loops without a
    unique solution.
    """
    model = diagram_model(diagram)
    diagram = (form := flatten_hierarchy(diagram)).diagram
    symbols = Symbols(model)
    flow = Tracing(model.flow, symbols, model.flow_order.sums)
    for node in model.flow_order.order:
        flow.evaluate(node)
    signals = _signal_values(model.flow, model.flow_order.order, model.shapes)
    units = {str(ref): unit for ref, unit in infer_units(diagram).items()}
    layout = signature(*(Slot(path, shape, units.get(path, "")) for path, shape, _ in signals))
    parameters = signature(*symbols.parameter_slots)
    values = parameters.pack(_parameter_values(diagram))

    loops = Implicit(model, symbols, flow, values)
    guards = guards_of(model, flow)
    entries = [(name, guard) for name, guard, value in guards for _ in range(value.numel())]
    modes, followers, contradictions = mode_contradictions(model, symbols, flow)
    momentary = momentary_states(model, symbols)
    point = {"t": symbols.t, "x": symbols.x, "z": symbols.z, "w": loops.w, "p": symbols.p}
    m, e, p = {"m": symbols.m}, {"e": symbols.e}, {"p": symbols.p}

    products, updated, updated_products = loops.solved(flow.products), *_updated(model, symbols, flow, loops)

    def function(name: str, inputs: Mapping[str, SX], **results: Sequence[SX]) -> TracedFunction:
        rounded = products if inputs.keys() >= point.keys() else SX(0, 1)
        return _flat_function(
            name, inputs, {key: loops.solved(parts) for key, parts in results.items()}, rounded
        )

    residual = function("residual", point, r=[loops.residual])
    update = function("update", point | m, z=[updated])
    return HybridSystem(
        name=diagram.name,
        states=signature(*symbols.state_slots),
        discrete=signature(*symbols.discrete_slots),
        algebraic=loops.slots,
        parameters=parameters,
        signals_layout=layout,
        clocks=model.sampling.clocks,
        parameter_values=values,
        derivative=function("derivative", point, xd=_derivatives(model, flow)),
        signals=function("signals", point, y=[_record_of(diagram, flow, value) for *_, value in signals]),
        residual=residual,
        residual_jacobian=_residual_jacobian(residual, loops.w),
        captures=_has_captures(model),
        called=tuple(name for name, block in diagram.blocks.items() if block.called),
        update=dataclasses.replace(update, rounded=vertcat(products, loops.solved([updated_products]))),
        guards=function("guards", point, g=[value for _, _, value in guards]),
        guard_directions=tuple(guard.direction for _, guard in entries),
        guard_names=tuple(name for name, _ in entries),
        guard_actions=tuple(guard.action for _, guard in entries),
        modes=modes,
        followers=followers,
        hysteresis_modes=hysteresis_modes(model, symbols),
        recaptured_states=recaptured_states(model, symbols),
        momentary_states=tuple(momentary.values()),
        disabled_guards=disabled_guards(entries, momentary),
        ranks=event_ranks(model, symbols, entries),
        locating_guards=tuple(number for number, (_, guard) in enumerate(entries) if guard.locates),
        contradictions=function("contradictions", point, c=contradictions) if modes else None,
        reset=function("reset", point | e, **_reset(model, symbols, flow)),
        initial_states=function("initial_states", p, x0=_initial_values(model, symbols)),
        initial_discrete=function("initial_discrete", p, z0=_initial_discrete(model, symbols)),
        initial_algebraic=function("initial_algebraic", p, w0=[loops.guesses]),
        breakpoints=function("breakpoints", p, times=_breakpoints(model, symbols)),
        aliases=_aliases(form, layout),
        delays=_delays(model, symbols, flow, loops, point, products),
        loops=_linear_loops(loops, point),
    )


def _linear_loops(loops: Implicit, point: Mapping[str, SX]) -> LinearLoops | None:
    """The signals and matrices of the linear loops; ``None`` if the diagram has none."""
    if not loops.linear:
        return None
    matrices = loops.solved([flatten(matrix, matrix.shape) for _, matrix in loops.linear])
    return LinearLoops(
        signals=tuple(names for names, _ in loops.linear),
        matrices=_flat_function("loop_matrices", point, {"A": matrices}, SX(0, 1)),
    )


def _updated(model: Model, symbols: Symbols, flow: Tracing, loops: Implicit) -> tuple[SX, SX]:
    """All discrete variables after a tick, and the signals that are products.

    Raises ``DiagramError`` where a nonlinear loop depends on a signal that is sampled at the same tick.
    """
    tick = Tracing(model.tick, symbols, model.tick_order.sums, _tick_marks(model, symbols))
    for node in model.tick_order.order:
        tick.evaluate(node)
    equations, discrete = model.tick.equations, dict(symbols.discrete)
    for name in model.sampling.clock_of:
        for index, group in enumerate(equations[name].groups):
            for slot in group.slots:
                if slot.kind in AT_TICKS:
                    value = tick.value(Value(Node(name, index, 0), slot.kind, slot.name))
                    discrete[f"{name}/{slot.name}"] = value
    discrete |= _captured(model, symbols, flow, discrete)
    updated, products = vertcat(*discrete.values(), SX(0, 1)), vertcat(*tick.products, SX(0, 1))
    if not tick.unknowns:
        return updated, products
    cuts = vertcat(*tick.unknowns.values())
    residual = tick.residuals()
    solution, remaining, _ = solve_affine(cuts, residual)
    if remaining and depends_on(residual[remaining], symbols.m):
        value = next(iter(tick.unknowns))
        raise DiagramError(
            f"the loop {' -> '.join(model.tick_order.loops[value.node])} is not linear, depends on a sampled "
            "signal, and is sampled itself at the same tick",
            where=f"diagram '{model.tick.diagram.name}'",
            allowed="linear loops, or loops that no sampled block reads at the tick that changes them",
            fix="put a Unit Delay between the loop and one of the sampled blocks",
        )
    if remaining:
        # These are the equations between ticks, possibly with other cuts. Their solution is known.
        loop_solution = loops.solved(
            [flow.value(_same_quantity(model.flow, value)) for value in tick.unknowns]
        )
        solution = substitute(solution, cuts[remaining], loop_solution[remaining])
    return substituted(updated, cuts, solution), substituted(products, cuts, solution)


def _tick_marks(model: Model, symbols: Symbols) -> dict[tuple[str, SlotKind], SX]:
    """Whether the outputs and the discrete states of each sampled block change at a tick."""
    marks = {name: symbols.m[clock] for name, clock in model.sampling.clock_of.items()}
    events = model.events if model.events is not None and len(model.events.before_ticks) > 1 else None

    def changes(mark: SX, name: str, kind: SlotKind) -> SX:
        if events is None:
            return mark
        return logic_or(mark == 1.0, mark == float(events.level_of[name, kind] + 2))

    return {(name, kind): changes(mark, name, kind) for name, mark in marks.items() for kind in AT_TICKS}


def _has_captures(model: Model) -> bool:
    own = model.flow.equations.values()
    return any(kind is SlotKind.CAPTURE for equations in own for kind, _ in equations.group_of)


def _captured(model: Model, symbols: Symbols, flow: Tracing, after_tick: Mapping[str, SX]) -> dict[str, SX]:
    """The updates of states that store left limits. An update without ticks captures the left limits."""
    ticking = dot(symbols.m, symbols.m) if symbols.m.numel() else SX(0.0)
    return {
        f"{name}/{slot}": if_else(
            ticking == 0.0,
            flow.value(model.flow.slot(name, kind, slot)),
            after_tick[f"{name}/{slot}"],
        )
        for name, equations in model.flow.equations.items()
        for kind, slot in equations.group_of
        if kind is SlotKind.CAPTURE
    }


def _breakpoints(model: Model, symbols: Symbols) -> list[SX]:
    """The breakpoints: times at which sources jump."""
    return [
        SX(time)
        for name, equations in model.flow.equations.items()
        for time in equations.features.breakpoints(symbols.parameters_of(name))
    ]


def _record_of(diagram: Diagram, flow: Tracing, value: Value) -> SX:
    """The recorded value of a signal; a non-finite value in an inactive subsystem is recorded as 0."""
    recorded, gate = flow.value(value), diagram.gates.get(value.node.block, {})
    for control in (ON, FIRE):
        if control in gate:
            active = flow.value(flow.network.input(value.node.block, control))
            recorded = if_else(logic_or(active, fabs(recorded) <= sys.float_info.max), recorded, 0.0)
    return recorded


def _same_quantity(network: Network, value: Value) -> Value:
    """The same quantity in another network, whose blocks may have other groups."""
    group = network.equations[value.node.block].group_of[value.kind, value.name]
    return value._replace(node=value.node._replace(group=group))


def _residual_jacobian(residual: TracedFunction, w: SX) -> TracedFunction:
    """The Jacobian of the implicit equations."""
    rates = densify(jacobian(residual.results[0], w))
    return dataclasses.replace(
        residual,
        name="residual_jacobian",
        outputs=signature(("J", rates.shape)),
        results=(flatten(rates, rates.shape),),
    )


def _derivatives(model: Model, flow: Tracing) -> list[SX]:
    return [
        flow.value(model.flow.state_rate(name, state.name, 1))
        for name, equations in model.flow.equations.items()
        for state in equations.states
    ]


def _delays(
    model: Model, symbols: Symbols, flow: Tracing, loops: Implicit, point: Mapping[str, SX], products: SX
) -> Delays | None:
    """The delayed signals and their delays. Raises ``DiagramError`` where a delay depends on itself."""
    ranges = signature(*symbols.discrete_slots).ranges
    values: list[int] = []
    derivatives: list[int] = []
    fixed: list[bool] = []
    columns: dict[str, list[SX]] = {"u": [], "du": [], "tau": [], "shortest": [], "longest": []}
    delayed: list[SX] = [loops.w]
    for name, equations in model.flow.equations.items():
        if not equations.delays:
            continue
        bounds = equations.features.delay_bounds(symbols.parameters_of(name))
        for line in equations.delays:
            kinds = (SlotKind.DELAYED, SlotKind.DELAYED_RATE, SlotKind.DELAY)
            u, du, tau = (flow.value(model.flow.slot(name, kind, line.name)) for kind in kinds)
            of_value, of_derivative = ranges[f"{name}/{line.name}"], ranges[f"{name}/{line.name}'"]
            values += range(of_value.start, of_value.stop)
            derivatives += range(of_derivative.start, of_derivative.stop)
            fixed += [line.name in equations.fixed_delays] * u.numel()
            ones = SX.ones(u.numel())
            parts = (u, du, tau * ones, *(bound * ones for bound in bounds[line.name]))
            for key, part in zip(columns, parts):
                columns[key].append(part)
            delayed += [symbols.discrete[f"{name}/{line.name}{mark}"] for mark in ("", "'")]
    if not values:
        return None
    taus = loops.solved(columns["tau"])
    if depends_on(taus, vertcat(*delayed)):
        raise DiagramError(
            "the delay time depends on a delayed signal, or on a nonlinear loop",
            where=f"diagram '{model.flow.diagram.name}'",
            allowed="delay times that depend on time, states and sampled signals",
            fix="pass the delay time through a lag or a sampled block first",
        )

    def function(title: str, inputs: Mapping[str, SX], *keys: str) -> TracedFunction:
        rounded = products if inputs.keys() >= point.keys() else SX(0, 1)
        column = loops.solved([part for key in keys for part in columns[key]])
        return _flat_function(title, inputs, {"d": column}, rounded)

    return Delays(
        values=tuple(values),
        derivatives=tuple(derivatives),
        fixed=tuple(fixed),
        inputs=function("delay_inputs", point, "u", "du"),
        times=function("delay_times", point, "tau"),
        bounds=function("delay_bounds", {"p": symbols.p}, "shortest", "longest"),
    )


def _reset(model: Model, symbols: Symbols, flow: Tracing) -> dict[str, list[SX]]:
    """States and discrete variables after events; without events, the consistent modes."""
    states, discrete = dict(symbols.states), dict(symbols.discrete)
    no_event = dot(symbols.e, symbols.e) == 0.0 if symbols.e.numel() else SX(1.0)
    for name, equations in model.flow.equations.items():
        for kind, slot in equations.group_of:
            path = f"{name}/{slot}"
            if kind is SlotKind.RESET:
                after = flow.value(model.flow.slot(name, kind, slot))
                (states if path in states else discrete)[path] = after
        for mode in equations.modes:
            path = f"{name}/{mode.name}"
            consistent = flow.value(model.flow.slot(name, SlotKind.MODE, mode.name))
            requested = no_event
            if mode.follows:  # its value needs no event
                inconsistent = flow.value(model.flow.slot(name, SlotKind.CONTRADICTION, mode.name))
                requested = logic_or(no_event, inconsistent)
            discrete[path] = if_else(requested, consistent, discrete[path])
    return {"x": list(states.values()), "z": list(discrete.values())}


def _flat_function(
    name: str, inputs: Mapping[str, SX], outputs: Mapping[str, SX], rounded: SX
) -> TracedFunction:
    def layout(columns: Mapping[str, SX]) -> Signature:
        shapes = {letter: () if letter == "t" else (column.numel(),) for letter, column in columns.items()}
        return Signature(tuple(Slot(letter, shape) for letter, shape in shapes.items()))

    arguments, results = tuple(inputs.values()), tuple(outputs.values())
    return TracedFunction(name, layout(inputs), layout(outputs), arguments, results, rounded)


def _signal_values(
    network: Network, order: Sequence[Node], shapes: DiagramShapes
) -> list[tuple[str, tuple[int, ...], Value]]:
    """Path, shape and location of every recorded signal, in evaluation order."""
    derived: dict[Node, list[PortRef]] = {}
    internal = _internal_outputs(network.diagram)
    for name, block in network.diagram.blocks.items():
        for port in block.time_derivatives:
            ref = PortRef(name, port)
            derived.setdefault(network.output(ref).node, []).append(ref)

    def recorded(node: Node, slot: BlockSlot) -> bool:
        # For a sampled block the held outputs are recorded.
        computed = slot.kind is SlotKind.OUTPUT and not network.diagram.clocked(node.block)
        if slot.kind is SlotKind.OUTPUT and slot.name in internal.get(node.block, ()):
            return False
        return node.order == 0 and (computed or slot.kind is SlotKind.RECORD)

    signals: list[tuple[str, tuple[int, ...], Value]] = []
    for node in order:
        if node.group == HELD:
            if node.order == 0:
                held = shapes.outputs[node.block]
                signals.extend(
                    (f"{node.block}/{port}", shape, Value(node, SlotKind.OUTPUT, port))
                    for port, shape in held.items()
                )
            signals.extend(
                (str(ref), shapes.outputs[ref.block][ref.port], network.output(ref))
                for ref in derived.get(node, [])
            )
            continue
        for slot in network.equations[node.block].groups[node.group].slots:
            if recorded(node, slot):
                path = f"{node.block}/{slot.name}"
                signals.append((path, slot.shape, Value(node, slot.kind, slot.name)))
        signals.extend(
            (str(ref), shapes.outputs[ref.block][ref.port], network.output(ref))
            for ref in derived.get(node, [])
        )
    return signals


def _parameter_values(diagram: Diagram) -> dict[str, Any]:
    return {
        f"{diagram.owner(name)}.{rule.name}": block.parameter_value(rule.name)
        for name, block in diagram.blocks.items()
        for rule in block.inputs_of_the_run()
    }


def _initial_values(model: Model, symbols: Symbols) -> list[SX]:
    values: list[SX] = []
    for name, equations in model.flow.equations.items():
        starts = equations.features.initial_states(symbols.parameters_of(name))
        values.extend(broadcast_column(SX(starts[state.name]), state.shape) for state in equations.states)
    return values


def _initial_discrete(model: Model, symbols: Symbols) -> list[SX]:
    values: list[SX] = []
    for name, equations in model.flow.equations.items():
        features, p = equations.features, symbols.parameters_of(name)
        known = {**features.initial_states(p), **features.initial_history(p)}
        slots = equations.discrete
        values.extend(broadcast_column(SX(known.get(slot.name, 0.0)), slot.shape) for slot in slots)
        if name in model.sampling.clock_of:
            held = features.initial_outputs(p)
            shapes = model.shapes.outputs[name]
            values.extend(broadcast_column(SX(held.get(port, 0.0)), shape) for port, shape in shapes.items())
    return values


def _aliases(form: FlatForm, layout: Signature) -> dict[str, str]:
    """Other names of signals: the user's names, names of blocks with one output, input and virtual ports."""
    aliases: dict[str, str] = {}
    used_names = set(layout.names)
    internal = {f"{name}/{port}" for name, ports in _internal_outputs(form.diagram).items() for port in ports}
    for name, block in form.diagram.blocks.items():
        outputs = block.output_ports()
        if len(outputs) == 1:
            aliases[name] = f"{name}/{outputs[0].name}"
    for wire in form.diagram.connections:
        if str(wire.target) not in used_names:
            aliases[str(wire.target)] = str(wire.source)
        if isinstance(form.diagram.blocks[wire.target.block], Outport):
            aliases[wire.target.block] = str(wire.source)
    aliases.update({name: str(ref) for name, ref in form.aliases.items() if name not in used_names})
    aliases.update({name: str(ref) for name, ref in named_signals(form)})
    if internal:
        aliases = {name: path for name, path in aliases.items() if path not in internal}
    return aliases


def _internal_outputs(diagram: Diagram) -> dict[str, frozenset[str]]:
    """The output ports by block that are not recorded; blocks without such ports are absent."""
    ports = {
        name: frozenset(port.name for port in block.output_ports() if port.internal)
        for name, block in diagram.blocks.items()
    }
    return {name: names for name, names in ports.items() if names}
