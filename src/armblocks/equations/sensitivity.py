"""A system together with the derivatives of its signals by some of its parameters.

For each chosen parameter ``p`` the state ``S = dx/dp`` is added, with ``S' = f_x S + f_z Z + f_w W + f_p``,
and likewise ``Z = dz/dp``, which ticks move by the derivative of ``update``, and ``W = dw/dp``, which the
differentiated implicit equations determine. At an event the time of which depends on the parameter (located
where a guard is 0) the derivative jumps besides::

    S+ = R_x S + R_z Z + R_p + (R_x f- + R_t - f+) dt/dp,    dt/dp = -(g_x S + g_z Z + g_p) / (g_x f- + g_t)

(Hiskens and Pai, IEEE Trans. Circuits and Systems I 47, 2000, 204-220). Where a guard fires because something
has jumped at a tick or a breakpoint, the instant is fixed and ``dt/dp = 0``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from casadi import SX, Function, densify, depends_on, dot, fabs, fmax, if_else, jacobian, jtimes, vertcat

from armblocks.equations.evaluation import refuse_called
from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.signatures import Signature, Slot, signature
from armblocks.equations.symbols import flatten
from armblocks.equations.table_reading import tables_read
from armblocks.equations.traced_function import TracedFunction
from armblocks.errors import InputError

LOCATED = 1e-8
"""A guard that would be 0 within this time (beside the time, s) was located there; else it jumped."""


def sensitivity_name(path: str, parameter: str) -> str:
    """The name of a derivative: ``x/y by k.gain``."""
    return f"{path} by {parameter}"


def parameters_read_by_index(system: HybridSystem) -> frozenset[str]:
    """The parameters that are long tables: no derivative by their entries is known (``table_reading``)."""
    functions = (system.derivative, system.signals, system.residual, system.update, system.guards)
    tables = {
        (place, place + count)
        for traced in (*functions, system.reset)
        for slot, place, count in tables_read(traced.casadi_function())
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
    """The system with the derivatives of ``outputs`` (paths of signals) by ``parameters`` (paths) as signals.

    Raises ``UnknownNameError`` for names, ``InputError`` for a parameter that moves a breakpoint or is a
    table that is read by index, and where events and implicit equations come together.
    """
    return _Augmented(system, parameters, outputs).system()


class _Augmented:
    def __init__(self, system: HybridSystem, parameters: Sequence[str], outputs: Sequence[str]) -> None:
        refuse_called(system, "derivatives")
        self.old = system
        self.t, self.x, self.z, self.w, self.p = system.derivative.arguments
        self.outputs = [system.signals_layout[name] for name in outputs]
        self.names: list[str] = []
        self.seeds: list[SX] = []
        for name in parameters:
            slot = system.parameters[name]
            places = range(*system.parameters.ranges[name].indices(system.parameters.size))
            for element, place in zip(slot.elements, places):
                seed = SX.zeros(self.p.numel())
                seed[place] = 1.0
                self.names.append(element)
                self.seeds.append(seed)
        self._refuse(parameters)
        count = len(self.names)
        self.S = [SX.sym("S", self.x.numel()) for _ in range(count)]
        self.Z = [SX.sym("Z", self.z.numel()) for _ in range(count)]
        self.W = [SX.sym("W", self.w.numel()) for _ in range(count)]
        self.layouts = {
            "x": self._widened(system.states),
            "z": self._widened(system.discrete),
            "w": self._widened(system.algebraic),
        }
        self.ends = {
            "t": self.t,
            "x": vertcat(self.x, *self.S),
            "z": vertcat(self.z, *self.Z),
            "w": vertcat(self.w, *self.W),
            "p": self.p,
        }

    def _refuse(self, parameters: Sequence[str]) -> None:
        system = self.old
        (p,) = system.breakpoints.arguments
        for name in parameters:
            if depends_on(vertcat(*system.breakpoints.results, SX(0, 1)), p[system.parameters.ranges[name]]):
                raise InputError(
                    f"the parameter '{name}' says when a signal jumps",
                    where=system.name,
                    allowed="parameters that move no breakpoint",
                    fix="take the difference of two runs for this one",
                )
        for name in parameters:
            if name in parameters_read_by_index(system):
                raise InputError(
                    f"the parameter '{name}' is a table that is read by index",
                    where=system.name,
                    allowed="parameters that are no entries of such tables",
                    fix="take the difference of two runs for this one",
                )
        if system.guard_names and system.algebraic.size:
            raise InputError(
                f"the events of '{system.guard_names[0]}' and the implicit equation of "
                f"'{system.algebraic.names[0]}' are in one diagram",
                where=system.name,
                allowed="sensitivities of diagrams with one or the other",
                fix="break the loop with a state, or take the difference of two runs",
            )

    def _widened(self, layout: Signature) -> Signature:
        added = [
            Slot(sensitivity_name(slot.name, name), slot.shape) for name in self.names for slot in layout
        ]
        return Signature((*layout.slots, *added))

    def value(self, traced: TracedFunction, *more: SX) -> SX:
        """The results of one of the system's functions in the symbols used here."""
        function = Function("f", list(traced.arguments), [vertcat(*traced.results, SX(0, 1))])
        (result,) = function.call([self.t, self.x, self.z, self.w, self.p, *more], True, False)
        return result

    def rate(self, expression: SX, k: int) -> SX:
        """Its derivative by parameter ``k``, everything following."""
        by = vertcat(self.x, self.z, self.w, self.p)
        return densify(jtimes(expression, by, vertcat(self.S[k], self.Z[k], self.W[k], self.seeds[k])))

    def widened(self, expression: SX) -> SX:
        """The expression and all its derivatives in one column."""
        return vertcat(densify(expression), *(self.rate(expression, k) for k in range(len(self.names))))

    def function(self, name: str, more: Mapping[str, SX], **results: SX) -> TracedFunction:
        """With flat symbols for all inputs, as every function of a system has them."""
        inside = {**self.ends, **more}
        fresh = {letter: SX.sym(letter, column.numel()) for letter, column in inside.items()}
        plain: list[SX] = [self.t, self.x, *self.S, self.z, *self.Z, self.w, *self.W, self.p, *more.values()]
        parts: list[SX] = []
        for letter, column in fresh.items():
            own = {"x": [self.x, *self.S], "z": [self.z, *self.Z], "w": [self.w, *self.W]}
            start = 0
            for piece in own.get(letter, [inside[letter]]):
                parts.append(column[start : start + piece.numel()])
                start += piece.numel()
        values = Function("f", plain, list(results.values())).call(parts, True, False)

        def ends(columns: Mapping[str, SX]) -> Signature:
            shapes = {key: () if key == "t" else (column.numel(),) for key, column in columns.items()}
            return Signature(tuple(Slot(key, shape) for key, shape in shapes.items()))

        return TracedFunction(
            name, ends(fresh), ends(results), tuple(fresh.values()), tuple(densify(v) for v in values)
        )

    def start(self, traced: TracedFunction, letter: str) -> TracedFunction:
        """Values at the start and their derivatives."""
        (p,) = traced.arguments
        value = vertcat(*traced.results, SX(0, 1))
        column = vertcat(densify(value), *(densify(jtimes(value, p, seed)) for seed in self.seeds))
        outputs = signature((letter, (column.numel(),)))
        return TracedFunction(traced.name, traced.inputs, outputs, traced.arguments, (column,))

    def reset(self) -> TracedFunction:
        """After an event; the derivative of its instant is that of the guard that fired."""
        old = self.old
        e = SX.sym("e", len(old.guard_directions))
        after = self.value(old.reset, e)
        n = self.x.numel()
        widened = [self.rate(after, k) for k in range(len(self.names))]
        if e.numel():
            g, f = self.value(old.guards), self.value(old.derivative)
            passing = jtimes(g, vertcat(self.t, self.x), vertcat(SX(1.0), f))
            flow = Function("f", [self.t, self.x, self.z, self.w, self.p], [f])
            (later,) = flow.call([self.t, after[:n], after[n:], self.w, self.p], True, False)
            # How the values after the event change with its instant alone.
            moved = jtimes(after, vertcat(self.t, self.x), vertcat(SX(1.0), f))
            jump = moved - vertcat(later, SX.zeros(self.z.numel()))
            near = fabs(g) <= LOCATED * fabs(passing) * fmax(1.0, fabs(self.t))
            fired = if_else(near, e * e, 0.0)
            count = fmax(dot(fired, fired), 1.0)
            for k in range(len(self.names)):
                instants = if_else(fired, -self.rate(g, k) / if_else(passing == 0.0, 1.0, passing), 0.0)
                widened[k] += jump * (dot(fired, instants) / count)
        return self.function(
            "reset",
            {"e": e},
            x=vertcat(after[:n], *(part[:n] for part in widened)),
            z=vertcat(after[n:], *(part[n:] for part in widened)),
        )

    def system(self) -> HybridSystem:
        """All functions together."""
        old = self.old
        m = SX.sym("m", len(old.clocks))
        residual = self.function("residual", {}, r=self.widened(self.value(old.residual)))
        slopes = densify(jacobian(residual.results[0], residual.arguments[3]))
        y = self.value(old.signals)
        rates: list[SX] = []
        slots: list[Slot] = []
        for k, name in enumerate(self.names):
            rate = self.rate(y, k)
            for slot in self.outputs:
                rates.append(rate[old.signals_layout.ranges[slot.name]])
                slots.append(Slot(sensitivity_name(slot.name, name), slot.shape))
        return dataclasses.replace(
            old,
            states=self.layouts["x"],
            discrete=self.layouts["z"],
            algebraic=self.layouts["w"],
            signals_layout=Signature((*old.signals_layout.slots, *slots)),
            derivative=self.function("derivative", {}, xd=self.widened(self.value(old.derivative))),
            signals=self.function("signals", {}, y=vertcat(y, *rates)),
            residual=residual,
            residual_jacobian=dataclasses.replace(
                residual,
                name="residual_jacobian",
                outputs=signature(("J", slopes.shape)),
                results=(flatten(slopes, slopes.shape),),
            ),
            update=self.function("update", {"m": m}, z=self.widened(self.value(old.update, m))),
            guards=self.function("guards", {}, g=self.value(old.guards)),
            reset=self.reset(),
            initial_states=self.start(old.initial_states, "x0"),
            initial_discrete=self.start(old.initial_discrete, "z0"),
            initial_algebraic=self.start(old.initial_algebraic, "w0"),
        )
