"""The vectors of a system with sensitivities: the symbols of its variables, and their positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from casadi import SX, Function, densify, dot, vertcat

from armblocks.equations.forward_differentiation import directional_derivative
from armblocks.equations.hybrid_system import HybridSystem
from armblocks.equations.signatures import Signature, Slot
from armblocks.equations.traced_function import TracedFunction

PREFIX = "sensitivity/"
"""Prefix of the names of discrete variables that only the sensitivities need."""


def sensitivity_name(path: str, parameter: str) -> str:
    """The name of a derivative: ``x/y by k.gain``."""
    return f"{path} by {parameter}"


def entry_name(slot: Slot, element: str) -> str:
    """The name of a parameter entry in results: ``k.gain`` for a parameter of one entry, else
    ``g.gain[1]``."""
    return slot.name if slot.size == 1 else element


def limit_name(block: str) -> str:
    """The name of a discrete variable with the time of the first instant (s; -1: never) after which a held
    signal of a block is at a limit."""
    return f"limit of {block}"


def any_marked(marks: SX) -> SX:
    """Whether an element of a column is not 0."""
    return dot(marks, marks) > 0.0 if marks.numel() else SX(0.0)


def _entries(layout: Signature, parameters: Sequence[str]) -> dict[str, int]:
    """The entries of parameters, without repetition: their names in results, and their indices in p."""
    indices: dict[str, int] = {}
    for name in parameters:
        slot, entries = layout.slot_of(name), layout.range_of(name)
        elements = slot.elements if name == slot.name else (name,)
        names = (entry_name(slot, element) for element in elements)
        indices.update(zip(names, range(entries.start, entries.stop)))
    return indices


class Columns:
    """The symbols ``t, x, z, w, p`` of a system, sensitivities of ``x``, ``z``, ``w``, and added variables.

    ``parameters``: paths of parameters, or of entries of parameters (``g.gain[1]``).

    For parameter ``k``, with the unit vector ``seeds[k]``: ``S[k]`` = dx/dp (nx,), ``Z[k]`` = dz/dp (nz,) and
    ``W[k]`` = dw/dp (nw,). ``V`` = dw/dt (nw,). Further discrete variables are added one by one.
    """

    def __init__(self, system: HybridSystem, parameters: Sequence[str], *, moving: bool) -> None:
        self.system = system
        self.t, self.x, self.z, self.w, self.p = system.derivative.arguments
        self.names: list[str] = []
        self.seeds: list[SX] = []
        for element, index in _entries(system.parameters, parameters).items():
            seed = SX.zeros(self.p.numel())
            seed[index] = 1.0
            self.names.append(element)
            self.seeds.append(seed)
        self.S = [SX.sym("S", self.x.numel()) for _ in self.names]
        self.Z = [SX.sym("Z", self.z.numel()) for _ in self.names]
        self.W = [SX.sym("W", self.w.numel()) for _ in self.names]
        self.V = SX.sym("V", self.w.numel() if moving else 0)
        self.added: dict[str, SX] = {}
        self.starts: dict[str, SX] = {}

    def add(self, name: str, size: int, start: SX | float | Sequence[float] = 0.0) -> SX:
        """Add a discrete variable (size,) with its initial value; return its symbol."""
        symbol = SX.sym(name, size)
        self.added[name] = symbol
        self.starts[name] = densify(SX.ones(size) * SX(start))
        return symbol

    def index(self, name: str) -> int:
        """The first index of an added discrete variable in the augmented ``z``."""
        index = self.z.numel() * (1 + len(self.names))
        for other, symbol in self.added.items():
            if other == name:
                return index
            index += symbol.numel()
        raise KeyError(name)

    def value(self, traced: TracedFunction, *arguments: SX) -> SX:
        """The results of a system function of ``t, x, z, w, p`` as expressions in these symbols."""
        return self.value_at(traced, self.t, self.x, self.z, self.w, *arguments)

    def value_at(self, traced: TracedFunction, t: SX, x: SX, z: SX, w: SX, *arguments: SX) -> SX:
        """The results of a system function at another point."""
        function = Function("f", list(traced.arguments), [vertcat(*traced.results, SX(0, 1))])
        (result,) = function.call([t, x, z, w, self.p, *arguments], True, False)
        return densify(result)

    def products(self, traced: TracedFunction, *arguments: SX) -> SX:
        """The products of a system function that are separate values, as expressions in these symbols."""
        function = Function("f", list(traced.arguments), [traced.rounded])
        (result,) = function.call([self.t, self.x, self.z, self.w, self.p, *arguments], True, False)
        return result

    def derivative_along(self, expression: SX, *, t: SX | float, x: SX, z: SX, w: SX, p: SX) -> SX:
        """The directional derivative of an expression in these symbols."""
        if not expression.numel():
            return SX(0, 1)
        by = vertcat(self.t, self.x, self.z, self.w, self.p)
        return densify(directional_derivative(expression, by, vertcat(t, x, z, w, p)))

    def extended(self, layout: Signature, letter: str) -> Signature:
        """The slots of ``x``, ``z`` or ``w``, and the slots of their sensitivities."""
        added = [
            Slot(sensitivity_name(slot.name, name), slot.shape) for name in self.names for slot in layout
        ]
        if letter == "z":
            added += [Slot(PREFIX + name, (symbol.numel(),)) for name, symbol in self.added.items()]
        if letter == "w" and self.V.numel():
            added += [Slot(f"{slot.name}'", slot.shape) for slot in layout]
        return Signature((*layout.slots, *added))

    def _parts(self, letter: str) -> list[SX]:
        parts = {
            "x": [self.x, *self.S],
            "z": [self.z, *self.Z, *self.added.values()],
            "w": [self.w, *self.W, self.V],
        }
        return parts[letter]

    def function(
        self, name: str, inputs: Mapping[str, SX], rounded: SX | None = None, **results: SX
    ) -> TracedFunction:
        """A function of the augmented system, with flat symbols for all inputs.

        ``rounded``: the products that are separate values; by default those of the signals. With them the
        signals have the same bits as in a run without derivatives.
        """
        inside: dict[str, list[SX]] = {"t": [self.t]}
        inside |= {letter: self._parts(letter) for letter in "xzw"}
        inside |= {"p": [self.p]} | {letter: [column] for letter, column in inputs.items()}
        plain: list[SX] = []
        parts_given: list[SX] = []
        symbols: dict[str, SX] = {}
        for letter, parts in inside.items():
            symbols[letter] = SX.sym(letter, sum(part.numel() for part in parts))
            start = 0
            for part in parts:
                plain.append(part)
                parts_given.append(symbols[letter][start : start + part.numel()])
                start += part.numel()
        separate = self.products(self.system.signals) if rounded is None else rounded
        *values, separate = Function("f", plain, [*results.values(), separate]).call(parts_given, True, False)

        def ends(columns: Mapping[str, SX]) -> Signature:
            shapes = {key: () if key == "t" else (column.numel(),) for key, column in columns.items()}
            return Signature(tuple(Slot(key, shape) for key, shape in shapes.items()))

        columns = tuple(densify(value) for value in values)
        return TracedFunction(name, ends(symbols), ends(results), tuple(symbols.values()), columns, separate)
