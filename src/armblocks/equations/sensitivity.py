"""A system together with the derivatives of its signals with respect to some of its parameters.

For each chosen parameter ``p`` the state ``S = dx/dp`` is added, with ``S' = f_x S + f_z Z + f_w W + f_p``.
``Z = dz/dp`` changes at ticks by the derivative of ``update``, and ``W = dw/dp`` follows from the
differentiated implicit equations. At instants whose times depend on parameters, the sensitivities also jump:
:mod:`armblocks.equations.sensitivity_instants`. Sensitivities of delayed signals are delayed as well:
:mod:`armblocks.equations.sensitivity_delays`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from casadi import SX, Function, densify, depends_on, jacobian, jtimes, vertcat

from armblocks.equations.evaluation import refuse_called
from armblocks.equations.forward_differentiation import directional_derivative
from armblocks.equations.held_limits import held_limits
from armblocks.equations.hybrid_system import HybridSystem, LinearLoops
from armblocks.equations.located_jumps import with_located_jumps
from armblocks.equations.sampled_limits import samples_limits
from armblocks.equations.sensitivity_delays import DelayedSensitivities
from armblocks.equations.sensitivity_instants import Instants
from armblocks.equations.sensitivity_layout import PREFIX, Columns, limit_name, sensitivity_name
from armblocks.equations.sensitivity_start import refuse_moving_start
from armblocks.equations.signatures import Signature, Slot, signature
from armblocks.equations.symbols import flatten
from armblocks.equations.table_reading import tables_read
from armblocks.equations.traced_function import TracedFunction
from armblocks.errors import InputError

MIXED = PREFIX + "mixed"
"""A discrete variable (2,): the first time (s; -1: never) at which events coincided whose times have
different derivatives with respect to a parameter, and the number of one of their guards, from 1."""
TIES = (PREFIX + "tie", PREFIX + "latest tie")
"""The same for a guard that is 0 after an instant: at the first, and at the latest of these instants."""
SAMPLED = PREFIX + "sampled"
"""The same for a signal that is at a limit when a tick samples it, with the number of the discrete variable
that has sampled it, from 1."""
LIMIT = PREFIX + limit_name("")
"""The name of a discrete variable, without the name of a block: the first time (s; -1: never) after which a
held signal of this block is at a limit."""


def parameters_read_by_index(system: HybridSystem) -> frozenset[str]:
    """The parameters that are tables read by index. Derivatives with respect to their entries are not
    available (``table_reading``)."""
    functions = (system.derivative, system.signals, system.residual, system.update, system.guards)
    tables = {
        (index, index + count)
        for traced in (*functions, system.reset)
        for slot, index, count in tables_read(traced.casadi_function())
        if traced.inputs.names[slot] == "p"
    }
    ranges = system.parameters.ranges
    return frozenset(
        name
        for name in system.parameters.names
        if any(ranges[name].start < end and start < ranges[name].stop for start, end in tables)
    )


def sensitivity_system(
    system: HybridSystem, parameters: Sequence[str], outputs: Sequence[str]
) -> HybridSystem:
    """The system with the derivatives of ``outputs`` (paths of signals) with respect to ``parameters``
    (paths, or entries such as ``g.gain[1]``) as signals.

    Raises ``UnknownNameError`` for unknown names. Raises ``InputError`` for a parameter that is a table read
    by index, that acts only through its integer part, or that moves an event at the start; also for implicit
    equations together with delays or with a parameter that determines the time of a jump.
    """
    refuse_called(system, "derivatives")
    _refuse_tables(system, parameters)
    system = with_located_jumps(system, [k for name in parameters for k in _indices(system, name)])
    _refuse_whole_numbers(system, parameters)
    refuse_moving_start(system, parameters)
    return _AugmentedSystem(system, parameters, outputs).system()


def _indices(system: HybridSystem, name: str) -> range:
    """The indices in p of a parameter, or of an entry of a parameter."""
    entries = system.parameters.range_of(name)
    return range(entries.start, entries.stop)


def _refuse_tables(system: HybridSystem, parameters: Sequence[str]) -> None:
    for name in parameters:
        if system.parameters.slot_of(name).name in parameters_read_by_index(system):
            raise InputError(
                f"the parameter '{name}' is a table that is read by index",
                where=system.name,
                allowed="parameters outside such tables",
                fix="use the difference of two runs for this parameter",
            )


def _refuse_implicit_jumps(system: HybridSystem, *, sources: bool) -> None:
    """Raise ``InputError`` for implicit equations whose solutions jump other than at zeros of guards."""
    if system.algebraic.size and (sources or system.delays is not None):
        jumping = "the parameter that determines when a signal jumps"
        cause = jumping if system.delays is None else "the delayed signals"
        raise InputError(
            f"{cause} and the implicit equation of '{system.algebraic.names[0]}' are in one diagram",
            where=system.name,
            allowed="sensitivities of diagrams with one or the other",
            fix="break the loop with a state, or take the difference of two runs",
        )


def _refuse_whole_numbers(system: HybridSystem, parameters: Sequence[str]) -> None:
    """Raise ``InputError`` for a parameter that acts only through comparisons or its integer part (a
    seed)."""
    for name in parameters:
        acts, smoothly = False, False
        for traced in _functions(system):
            if "p" not in traced.inputs.names or smoothly:
                continue
            p = traced.arguments[traced.inputs.names.index("p")]
            results = vertcat(*traced.results, SX(0, 1))
            if results.numel() and depends_on(results, p[system.parameters.range_of(name)]):
                acts = True
                smoothly = not jtimes(results, p, _direction(system, name)).is_zero()
        if acts and not smoothly:
            raise InputError(
                f"the parameter '{name}' acts only through comparisons or its integer part",
                where=system.name,
                allowed="parameters with a differentiable effect",
                fix="compare runs with different values",
            )


def _functions(system: HybridSystem) -> list[TracedFunction]:
    """All functions of a system."""
    delays = () if system.delays is None else (system.delays.inputs, system.delays.times)
    values = [getattr(system, entry.name) for entry in dataclasses.fields(system)]
    return [*(value for value in values if isinstance(value, TracedFunction)), *delays]


def _direction(system: HybridSystem, name: str) -> SX:
    """A change of all entries of a parameter, in p."""
    direction = SX.zeros(system.parameters.size)
    for number, index in enumerate(_indices(system, name)):
        direction[index] = 1.0 + 0.37 * number
    return direction


class _AugmentedSystem:
    """Builds the functions of a system with sensitivities."""

    def __init__(self, system: HybridSystem, parameters: Sequence[str], outputs: Sequence[str]) -> None:
        self.old = system
        (p,) = system.breakpoints.arguments
        chosen = vertcat(*(p[system.parameters.range_of(name)] for name in parameters))
        sources = depends_on(vertcat(*system.breakpoints.results, SX(0, 1)), chosen)
        _refuse_implicit_jumps(system, sources=sources)
        limits = held_limits(system)
        self.moving = bool(
            system.guard_directions
            or system.delays is not None
            or sources
            or limits
            or samples_limits(system)
        )
        self.outputs = [system.signals_layout[name] for name in outputs]
        self.columns = Columns(system, parameters, moving=self.moving)
        self.delays = DelayedSensitivities(self.columns)
        self.instants = Instants(self.columns, self.delays, limits) if self.moving else None

    def _names(self, count: int) -> list[str]:
        """Names of the added guards for messages: the names of their blocks, or of the system."""
        if self.instants is None:
            return []
        elements = [element for slot in self.old.discrete for element in slot.elements]
        delays = [elements[index].rpartition("/")[0] for index in self.delays.values]
        breakpoints = [self.instants.source(index) for index in self.instants.moving_breakpoints]
        names = [self.old.name, self.old.name, *breakpoints, *delays, *delays, self.old.name]
        assert len(names) == count
        return names

    def rate(self, expression: SX, k: int) -> SX:
        """The total derivative of an expression with respect to parameter ``k``."""
        c = self.columns
        return c.derivative_along(expression, t=0.0, x=c.S[k], z=self.delays.Z[k], w=c.W[k], p=c.seeds[k])

    def extended(self, expression: SX) -> SX:
        """The expression and its derivatives with respect to all parameters in one column."""
        return vertcat(expression, *(self.rate(expression, k) for k in range(len(self.columns.names))))

    def start(self, traced: TracedFunction, letter: str) -> TracedFunction:
        """Initial values and their derivatives."""
        (p,) = traced.arguments
        c = self.columns
        value = vertcat(*traced.results, SX(0, 1))
        parts = [value, *(directional_derivative(value, p, seed) for seed in c.seeds)]
        if letter == "z0" and c.added:
            starts = Function("f", [c.p], [vertcat(*c.starts.values())])
            parts += starts.call([p], True, False)
        if letter == "w0":
            parts.append(SX.zeros(c.V.numel()))
        column = densify(vertcat(*parts))
        outputs = signature((letter, (column.numel(),)))
        return TracedFunction(traced.name, traced.inputs, outputs, traced.arguments, (column,))

    def residual(self) -> TracedFunction:
        """The implicit equations, with their derivatives with respect to parameters and time."""
        c, r = self.columns, self.columns.value(self.old.residual)
        parts = [r, *(self.rate(r, k) for k in range(len(c.names)))]
        if self.instants is not None and r.numel():
            zeros = SX.zeros(r.numel())
            by_time = self.instants.over_time(r)
            parts.append(by_time)
            # If S is the derivative along an instant, W is the derivative along this instant as well.
            fixed = c.derivative_along(
                r, t=1.0, x=SX.zeros(c.x.numel()), z=self.delays.rate_along, w=zeros, p=0.0 * c.p
            )
            for k, instant in enumerate(self.instants.instant_p):
                parts[k + 1] = parts[k + 1] + self.instants.open * instant * fixed
        return c.function("residual", {}, r=vertcat(*parts))

    def system(self) -> HybridSystem:
        """The augmented system."""
        old, c, instants = self.old, self.columns, self.instants
        m = SX.sym("m", len(old.clocks))
        residual = self.residual()
        derivatives = densify(jacobian(residual.results[0], residual.arguments[3]))
        y = c.value(old.signals)
        rates: list[SX] = []
        slots: list[Slot] = []
        for k, name in enumerate(c.names):
            rate = self.rate(y, k)
            for slot in self.outputs:
                rates.append(rate[old.signals_layout.ranges[slot.name]])
                slots.append(Slot(sensitivity_name(slot.name, name), slot.shape))
        directions = () if instants is None else instants.directions()
        e = SX.sym("e", len(old.guard_directions) + len(directions))
        if instants is None:
            update, guards = self.extended(c.value(old.update, m)), c.value(old.guards)
            after = (vertcat(c.x, *c.S), vertcat(c.z, *c.Z))
        else:
            update, guards, after = instants.update(m), instants.all_guards(), instants.reset(e)
        return dataclasses.replace(
            old,
            states=c.extended(old.states, "x"),
            discrete=c.extended(old.discrete, "z"),
            algebraic=c.extended(old.algebraic, "w"),
            signals_layout=Signature((*old.signals_layout.slots, *slots)),
            derivative=c.function("derivative", {}, xd=self.extended(c.value(old.derivative))),
            signals=c.function("signals", {}, y=vertcat(y, *rates)),
            residual=residual,
            residual_jacobian=dataclasses.replace(
                residual,
                name="residual_jacobian",
                outputs=signature(("J", derivatives.shape)),
                results=(flatten(derivatives, derivatives.shape),),
            ),
            update=c.function("update", {"m": m}, c.products(old.update, m), z=update),
            guards=c.function("guards", {}, g=guards),
            ranks=None if old.ranks is None or instants is None else instants.ranks(old.ranks),
            tangents=(old.states.size, old.discrete.size, len(old.guard_directions)),
            contradictions=None
            if old.contradictions is None
            else c.function("contradictions", {}, c=c.value(old.contradictions)),
            guard_directions=(*old.guard_directions, *directions),
            guard_names=(*old.guard_names, *self._names(len(directions))),
            guard_actions=(*old.guard_actions, *[""] * len(directions)),
            reset=c.function("reset", {"e": e}, x=after[0], z=after[1]),
            initial_states=self.start(old.initial_states, "x0"),
            initial_discrete=self.start(old.initial_discrete, "z0"),
            initial_algebraic=self.start(old.initial_algebraic, "w0"),
            delays=self.delays.delays(),
            captures=old.captures or instants is not None,
            recaptured_states=tuple(
                k * old.discrete.size + index
                for k in range(len(c.names) + 1)
                for index in old.recaptured_states
            ),
            loops=None if old.loops is None else self.loops(old.loops),
        )

    def loops(self, old: LinearLoops) -> LinearLoops:
        """The linear loops of the original system; the loops of the derivatives have the same matrices."""
        c = self.columns
        matrices = c.function("loop_matrices", {}, A=c.value(old.matrices))
        return dataclasses.replace(old, matrices=matrices)
