"""A block whose equation is a Python function: traced with symbols once, then compiled like any other."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    UserFunction,
    WorkedExample,
    parameter,
)
from armblocks.equations import Shape, flatten, unflatten
from armblocks.errors import ArmblocksError, InputError


def unchanged(u: object) -> object:
    """What comes in, comes out: the function of a block that was given none."""
    return u


@dataclass(frozen=True, kw_only=True)
class PythonFunction(Block):
    """What a Python function gives: y = function(its inputs, t).

    Every argument without a default is an input of its name, but ``t``, which is the time (s). A scalar
    arrives as a symbol, a vector or matrix as a NumPy array of symbols, on which arithmetic, indices, ``@``
    and NumPy's functions work; the function runs once, when the diagram is traced, and its equations are
    compiled and differentiated like those of any block. It may not decide by values (``if u > 0``), as they
    are not known then: ``casadi.if_else``, ``fmin``, ``fmax`` and ``fabs`` do that in the equations. It must
    depend on its arguments alone. With several ``results`` it returns as many.

    A diagram's file keeps ``file.py:name`` and runs no code unless it is trusted.
    """

    family: ClassVar[str] = "functions"
    title: ClassVar[str] = "Python Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The function that every new block has: what comes in, comes out."
    )

    function: Any = parameter(
        unchanged,
        kind=ParameterKind.FUNCTION,
        of_type=UserFunction,
        doc="the function, such as def law(u, t)",
    )
    results: str = parameter("y", doc="names of the outputs, such as tau, power")

    def check(self) -> None:
        names = self._results()
        taken = {port.name for port in self.input_ports()}
        wrong = [name for name in names if not name.isidentifier() or names.count(name) > 1 or name in taken]
        if wrong or not names:
            raise InputError(
                f"the results are '{self.results}'",
                where="PythonFunction.results",
                allowed="names made of letters, digits and _, each once, that no argument has",
                fix="choose other names",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, "an argument") for name in self.function.arguments if name != "t")

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, "a result") for name in self._results())

    def output_shapes(self, inputs: Shapes) -> Shapes:
        u = {name: unflatten(SX.sym(name, math.prod(shape)), shape) for name, shape in inputs.items()}
        return {name: _shape(value) for name, value in self._called(SX.sym("t"), u, inputs).items()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shapes = {name: _natural_shape(value) for name, value in u.items()}
        return {name: _symbols(value) for name, value in self._called(t, u, shapes).items()}

    def _results(self) -> list[str]:
        return self.results.replace(",", " ").split()

    def _called(self, t: SX, u: Signals, shapes: Shapes) -> Mapping[str, Any]:
        """What the function gives for symbols."""
        user = cast("UserFunction", self.function)
        given = {name: _array(value, shapes[name]) for name, value in u.items()}
        if "t" in user.arguments:
            given["t"] = t
        names = self._results()
        where = f"the function {user.name}"
        try:
            with warnings.catch_warnings():
                # CasADi announces other types for numbers; symbols stay symbols
                warnings.simplefilter("ignore", FutureWarning)
                returned: Any = user.function(**given)
            values = [returned] if len(names) == 1 else list(returned)
            found = [value if isinstance(value, SX) else np.array(value, dtype=object) for value in values]
            for value in found:
                _symbols(value)
        except ArmblocksError:
            raise
        except Exception as error:
            raise InputError(
                f"{where} cannot be traced: {type(error).__name__}: {error}"[:400],
                allowed="arithmetic, NumPy's functions, and casadi.if_else, fmin, fmax where values decide",
                fix="replace 'if' by casadi.if_else, max by casadi.fmax, and functions of other libraries",
            ) from error
        if len(found) != len(names):
            raise InputError(
                f"{where} returns {len(found)} values for the results {', '.join(names)}",
                allowed="one value for each result",
                fix="correct the function or the names",
            )
        return dict(zip(names, found))


def _array(value: SX, shape: Shape) -> Any:
    """A symbol as the user's function gets it."""
    if not shape:
        return value
    found = np.empty(shape, dtype=object)
    flat = flatten(value, shape)
    for k, place in enumerate(itertools.product(*map(range, shape))):
        found[place] = flat[k]
    return found


def _natural_shape(value: SX) -> Shape:
    rows, columns = value.shape
    return (rows, columns) if columns > 1 else (rows,) if rows > 1 else ()


def _shape(value: Any) -> Shape:
    return _natural_shape(value) if isinstance(value, SX) else tuple(value.shape)


def _symbols(value: Any) -> SX:
    """What the user's function gave, in its natural shape."""
    if isinstance(value, SX):
        return value
    entries = SX.zeros(value.size)
    for k, entry in enumerate(value.ravel()):
        entries[k] = entry
    return unflatten(entries, value.shape)
