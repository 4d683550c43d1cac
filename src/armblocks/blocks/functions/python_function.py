"""Blocks that evaluate Python functions: traced and compiled like any block, or called at ticks."""

from __future__ import annotations

import itertools
import math
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np
from casadi import SX, if_else, sum1, sum2
from numpy.typing import ArrayLike

from armblocks.diagram import (
    Block,
    ParameterKind,
    Port,
    Shapes,
    Signals,
    State,
    UserFunction,
    WorkedExample,
    parameter,
    sample_time_parameter,
)
from armblocks.diagram.signs import FaceSign, Lines
from armblocks.equations import Shape, flatten, unflatten
from armblocks.errors import ArmblocksError, InputError, counted


def unchanged(u: object) -> object:
    """The identity: the default function of a new block."""
    return u


@dataclass(frozen=True, kw_only=True)
class PythonFunction(Block):
    """The value of a Python function: y = function(its inputs, t).

    The function runs once, when the diagram is traced, and its equations are compiled and differentiated like
    the equations of any block.

    - Every argument without a default is an input of that name, except ``t``, the time (s). A scalar input is
      a symbol; a vector or matrix is a NumPy array of symbols, which supports arithmetic, indices, ``@`` and
      NumPy's functions.
    - The values of the inputs are not known at that time, so the function cannot branch on them (``if u >
      0``): use ``casadi.if_else``, ``fmin``, ``fmax`` and ``fabs``.
    - The result must depend only on the arguments. It is one value for each name in ``results``.

    The file of a diagram stores ``file.py:name`` and runs no code unless it is trusted. The studio shows the
    code, and runs the code in a separate process after you have trusted the present content of the file.
    """

    title: ClassVar[str] = "Python Function"
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The default function of a new block: the identity."
    )

    function: Any = parameter(
        unchanged,
        kind=ParameterKind.FUNCTION,
        of_type=UserFunction,
        doc="the function, such as def law(u, t)",
    )
    results: str = parameter("y", doc="names of the outputs, such as tau, power")

    def face_sign(self) -> FaceSign:
        return Lines(("Python", f"{self.function.name}()"))

    def check(self) -> None:
        _check_results(self, _names(self.results))

    def input_ports(self) -> tuple[Port, ...]:
        return _argument_ports(self.function)

    def output_ports(self) -> tuple[Port, ...]:
        return tuple(Port(name, "a result") for name in _names(self.results))

    def output_shapes(self, inputs: Shapes) -> Shapes:
        u = {name: unflatten(SX.sym(name, math.prod(shape)), shape) for name, shape in inputs.items()}
        return {name: _shape(value) for name, value in self._called(SX.sym("t"), u, inputs).items()}

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        shapes = {name: _natural_shape(value) for name, value in u.items()}
        return {name: _symbols(value) for name, value in self._called(t, u, shapes).items()}

    def _called(self, t: SX, u: Signals, shapes: Shapes) -> Mapping[str, Any]:
        """The results of the function for symbolic arguments."""
        user = cast("UserFunction", self.function)
        arguments = {name: _array(value, shapes[name]) for name, value in u.items()}
        if "t" in user.arguments:
            arguments["t"] = t
        names = _names(self.results)
        where = f"the function {user.name}"
        try:
            with warnings.catch_warnings():
                # CasADi warns of a future change of the result type of NumPy functions. Here the type is SX.
                warnings.simplefilter("ignore", FutureWarning)
                returned: Any = user.function(**arguments)
            values = [returned] if len(names) == 1 else list(returned)
            results = [value if isinstance(value, SX) else np.array(value, dtype=object) for value in values]
            for value in results:
                _symbols(value)
        except ArmblocksError:
            raise
        except Exception as error:
            raise InputError(
                f"{where} cannot be traced: {user.failing_line(error)}{type(error).__name__}: {error}"[:400],
                allowed="arithmetic, NumPy's functions, and casadi.if_else, fmin, fmax in place of branches",
                fix="replace 'if' by casadi.if_else, max by casadi.fmax, and functions of other libraries; "
                "or use a CalledPythonFunction, which runs at its ticks",
            ) from error
        if len(results) != len(names):
            raise InputError(
                f"{where} returns {counted(len(results), 'value')} for the results {', '.join(names)}",
                allowed="one value for each result",
                fix="correct the function or the names",
            )
        return dict(zip(names, results))


@dataclass(frozen=True, kw_only=True)
class CalledPythonFunction(Block):
    """The value of a Python function at each tick: y(k) = function(inputs at the tick, t), held in between.

    This block is for functions that cannot be traced: a controller of another library, branches, a search in
    a table. Use a Python Function for a function that can be traced: it is much faster, works in continuous
    time and can be linearised.

    - The run stops at each tick and calls the function with numbers and NumPy arrays.
    - Blocks that tick at the same time use the new values.
    - The function may store data between calls. These data are not states of the diagram: they are neither
      saved with a state nor reset before another run.
    - The report of the run gives the number of calls and their share of the computing time.

    The file of a diagram stores ``file.py:name`` and runs no code unless it is trusted.
    """

    title: ClassVar[str] = "Python Function (called)"
    sampled: ClassVar[bool] = True
    called: ClassVar[bool] = True
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="The default function of a new block, the identity, called every 0.5 s.",
        parameters={"sample_time": 0.5},
    )

    function: Any = parameter(
        unchanged,
        kind=ParameterKind.FUNCTION,
        of_type=UserFunction,
        doc="the function, such as def law(u, t)",
    )
    results: str = parameter("y", doc="names of the outputs, such as tau, power")
    shapes: str = parameter("", doc="shapes of the outputs, such as 3, 2x2, 1; empty: all are scalars")
    sample_time: ArrayLike = sample_time_parameter(0.1)

    def check(self) -> None:
        names = _names(self.results)
        _check_results(self, names)
        entries = _names(self.shapes)
        if entries and (len(entries) != len(names) or not all(_SHAPE.fullmatch(entry) for entry in entries)):
            raise InputError(
                f"the shapes are '{self.shapes}' for the results {', '.join(names)}",
                where="CalledPythonFunction.shapes",
                allowed="one for each result: 1 for a scalar, 3 for a vector of length 3, 2x2 for a matrix",
                fix="give as many shapes as results",
            )

    def input_ports(self) -> tuple[Port, ...]:
        return _argument_ports(self.function)

    def output_ports(self) -> tuple[Port, ...]:
        names = _names(self.results)
        entries = _names(self.shapes) or ["1"] * len(names)
        shapes = [tuple(int(size) for size in entry.split("x")) for entry in entries]
        return tuple(
            Port(name, "a result", shape=() if shape == (1,) else shape) for name, shape in zip(names, shapes)
        )

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        arguments = (State(f"{name}?", shape, f"{name} at the tick") for name, shape in inputs.items())
        results = (
            State(f"{port.name}?", port.shape or (), f"result of the function for {port.name}")
            for port in self.output_ports()
        )
        return (*arguments, *results)

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        # The call is not an equation. This expression declares feedthrough from every input to every output,
        # which determines the order of the calls at a tick.
        all_inputs = sum((sum1(sum2(value)) for value in u.values()), SX(0.0))
        results = {port.name: x[f"{port.name}?"] for port in self.output_ports()}
        return {name: if_else(all_inputs > 0.0, value, value) for name, value in results.items()}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        arguments = {f"{name}?": value for name, value in u.items()}
        return arguments | {f"{port.name}?": x[f"{port.name}?"] for port in self.output_ports()}

    def initial_states(self, p: Signals) -> Signals:
        ports = (*self.input_ports(), *self.output_ports())
        return {f"{port.name}?": SX(0.0) for port in ports}

    def call(self, t: float, inputs: Mapping[str, Any]) -> Mapping[str, Any]:
        user = cast("UserFunction", self.function)
        arguments = {**inputs, **({"t": t} if "t" in user.arguments else {})}
        names = _names(self.results)
        try:
            returned: Any = user.function(**arguments)
            values = [returned] if len(names) == 1 else list(returned)
        except ArmblocksError:
            raise
        except Exception as error:
            raise InputError(
                f"the function {user.name} failed: {user.failing_line(error)}{type(error).__name__}: {error}"[
                    :400
                ],
                allowed="a function that takes and returns numbers and arrays",
                fix="correct the function",
            ) from error
        if len(values) != len(names):
            raise InputError(
                f"the function {user.name} returns {counted(len(values), 'value')} for the results "
                f"{', '.join(names)}",
                allowed="one value for each result",
                fix="correct the function or the names",
            )
        return dict(zip(names, values))


_SHAPE = re.compile("[1-9][0-9]*(x[1-9][0-9]*)?")


def _names(text: str) -> list[str]:
    """The names in a text that separates them by commas or spaces."""
    return text.replace(",", " ").split()


def _argument_ports(function: UserFunction) -> tuple[Port, ...]:
    return tuple(Port(name, "an argument") for name in function.arguments if name != "t")


def _check_results(block: Block, names: list[str]) -> None:
    """Raise ``InputError`` if the results of a function cannot be ports."""
    argument_names = {port.name for port in block.input_ports()}
    invalid = [
        name for name in names if not name.isidentifier() or names.count(name) > 1 or name in argument_names
    ]
    if invalid or not names:
        raise InputError(
            f"the results are '{block.parameter_value('results')}'",
            where=f"{block.type_name()}.results",
            allowed="unique names of letters, digits and _ that are not argument names",
            fix="choose other names",
        )


def _array(value: SX, shape: Shape) -> Any:
    """The argument of the user's function for a symbolic input: a symbol, or an array of symbols."""
    if not shape:
        return value
    array = np.empty(shape, dtype=object)
    flat = flatten(value, shape)
    for k, index in enumerate(itertools.product(*map(range, shape))):
        array[index] = flat[k]
    return array


def _natural_shape(value: SX) -> Shape:
    """The shape of a symbolic matrix: one entry is a scalar, one column is a vector."""
    rows, columns = value.shape
    return (rows, columns) if columns > 1 else (rows,) if rows > 1 else ()


def _shape(value: Any) -> Shape:
    return _natural_shape(value) if isinstance(value, SX) else tuple(value.shape)


def _symbols(value: Any) -> SX:
    """The result of the user's function as one symbolic matrix."""
    if isinstance(value, SX):
        return value
    entries = SX.zeros(value.size)
    for k, entry in enumerate(value.ravel()):
        entries[k] = entry
    return unflatten(entries, value.shape)
