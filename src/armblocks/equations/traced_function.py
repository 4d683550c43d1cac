"""A symbolic function with named inputs and outputs: the result of modelling for numerics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from casadi import SX, Function, vertcat
from numpy.typing import ArrayLike, NDArray

from armblocks.equations.signatures import Signature
from armblocks.equations.symbols import flatten, matrix_shape, unflatten
from armblocks.equations.table_reading import evaluate_with_reads, reads_tables
from armblocks.errors import InputError, counted


@dataclass(frozen=True, eq=False)
class TracedFunction:
    """``results = f(arguments)`` in symbols.

    ``arguments[i]`` is the flat column of symbols of input slot ``i``. ``results[j]`` is the flat dense
    column of output slot ``j`` (both row by row, see :mod:`armblocks.equations.signatures`).

    ``rounded``: products that are separate values, such as signals. The compiler rounds them even if they
    could be fused with a following sum. A signal is then bitwise the same in every function of a system, and
    a sum of signals is the sum of the recorded values. Products inside a block may be fused if no other
    expression of the function uses them.
    """

    name: str
    inputs: Signature
    outputs: Signature
    arguments: tuple[SX, ...]
    results: tuple[SX, ...]
    rounded: SX = field(default_factory=lambda: SX(0, 1))

    @classmethod
    def trace(
        cls, name: str, inputs: Signature, outputs: Signature, equations: Callable[..., SX | Sequence[SX]]
    ) -> TracedFunction:
        """Call ``equations`` once with symbols.

        ``equations`` receives one SX per input slot in its natural shape (scalar 1x1, vector as a column,
        matrix) and returns one SX per output slot in the same form.
        """
        symbols = tuple(SX.sym(slot.name, *matrix_shape((slot.size,))) for slot in inputs)
        natural = [unflatten(symbol, slot.shape) for symbol, slot in zip(symbols, inputs)]
        returned = equations(*natural)
        values = (returned,) if isinstance(returned, SX) else tuple(returned)
        if len(values) != len(outputs):
            raise InputError(
                f"the equations of '{name}' return {counted(len(values), 'value')}",
                allowed=counted(len(outputs), "value"),
                where=f"function '{name}'",
                fix="return one value for each output",
            )
        results = tuple(flatten(SX(value), slot.shape) for value, slot in zip(values, outputs))
        return cls(name=name, inputs=inputs, outputs=outputs, arguments=symbols, results=results)

    def joined(self, other: TracedFunction) -> TracedFunction:
        """This function with the results of another function of the same inputs appended."""
        *results, rounded = Function("f", list(other.arguments), [*other.results, other.rounded]).call(
            list(self.arguments), True, False
        )
        return TracedFunction(
            name=self.name,
            inputs=self.inputs,
            outputs=Signature((*self.outputs.slots, *other.outputs.slots)),
            arguments=self.arguments,
            results=(*self.results, *results),
            rounded=vertcat(self.rounded, rounded),
        )

    def casadi_function(self) -> Function:
        """The same function as a CasADi ``Function``: flat columns in, flat columns out."""
        return Function("f", list(self.arguments), list(self.results), {"cse": True})

    def __call__(self, *values: ArrayLike) -> tuple[NDArray[np.float64], ...]:
        """Evaluate with CasADi's interpreter: slow, and independent of the compiler."""
        flat = [np.asarray(value, dtype=np.float64).reshape(-1) for value in values]
        function = self.casadi_function()
        results = evaluate_with_reads(function, flat) if reads_tables(function) else function.call(flat)
        return tuple(np.asarray(value).reshape(slot.shape) for value, slot in zip(results, self.outputs))
