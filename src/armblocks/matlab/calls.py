"""Calls of the functions of the table, for numbers and for symbols."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import counted
from armblocks.matlab.function_kinds import Arithmetic, Function, MismatchError
from armblocks.matlab.functions import TABLE
from armblocks.matlab.source import Location


def selected_function(name: str, arguments: Sequence[Any]) -> tuple[Function, Sequence[Any]]:
    """The function that a call selects and its arguments: ``max(A, [], 2)`` selects a reduction of ``A``."""
    function = TABLE[name]
    if function.reduction and len(arguments) == 3 and 0 in arguments[1].shape:
        return function.reduction, (arguments[0], arguments[2])
    return function, arguments


def call_function(
    ops: Arithmetic,
    location: Location,
    name: str,
    function: Function,
    arguments: Sequence[Any],
    constant: Callable[[Any], NDArray[np.float64] | None],
) -> Any:
    """The value of a function of the table, with the given arithmetic.

    ``constant`` returns the numbers of an argument, or ``None`` where it depends on symbols. Raises an error
    at ``location`` for a wrong number of arguments or wrong sizes.
    """
    _check_count(location, name, function, len(arguments))
    try:
        if not function.creates_array:
            return function.compute(ops, *arguments)
        numbers = [constant(argument) for argument in arguments]
        if any(number is None for number in numbers):
            raise location.error(
                f"the size of an array created by {name} is not constant", allowed="constant numbers"
            )
        with np.errstate(all="ignore"):
            return ops.constant(function.compute(*numbers))
    except MismatchError as mismatch:
        raise location.error(f"{name}: {mismatch}", allowed=f"{name}({function.arguments})") from None


def _check_count(location: Location, name: str, function: Function, count: int) -> None:
    if function.min_arguments <= count <= function.max_arguments:
        return
    if count == 0:
        raise location.error(
            f"the function '{name}' is called without arguments", allowed=f"{name}({function.arguments})"
        )
    minimum, maximum = function.min_arguments, function.max_arguments
    allowed = f"{minimum}" if minimum == maximum else f"{minimum} to {maximum}"
    raise location.error(
        f"{name} is called with {counted(count, 'argument')}",
        allowed=f"{allowed}: {name}({function.arguments})" if maximum else "no arguments",
    )
