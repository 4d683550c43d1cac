"""Settings of a run as keyword arguments of the functions that run a diagram."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypedDict, TypeVar, cast, get_type_hints

from armblocks.equations import SimulationOptions
from armblocks.errors import UnknownArgumentError

Call = TypeVar("Call", bound=Callable[..., Any])


class RunSettings(TypedDict, total=False):
    """The fields of :class:`SimulationOptions`; omitted fields default to the diagram's settings."""

    stop_time: float
    solver: str
    step: float | None
    sample_time: float | None
    max_step: float | None
    rtol: float
    atol: float
    record_jumps: bool


_NAMES = frozenset(RunSettings.__annotations__)


class _DiagramDefault:
    """The default in signatures for the value of the diagram."""

    def __repr__(self) -> str:
        return "<the diagram's>"


def takes_settings(call: Call) -> Call:
    """Mark a function whose ``**settings`` are :class:`RunSettings`: its signature lists all of them.

    Type checkers read the annotation; ``help``, notebooks and the documentation read the signature.
    """
    signature = inspect.signature(call)
    hints, default = get_type_hints(RunSettings), _DiagramDefault()
    other_parameters = [
        entry for entry in signature.parameters.values() if entry.kind is not entry.VAR_KEYWORD
    ]
    settings = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)
        for name, hint in hints.items()
    ]
    changed = signature.replace(parameters=[*other_parameters, *settings])
    cast("Any", call).__signature__ = changed
    return call


def check_settings(settings: Mapping[str, object], call: Callable[..., object]) -> None:
    """Raise ``UnknownArgumentError`` for a keyword argument that ``call`` does not have."""
    for name in settings:
        if name not in _NAMES:
            argument_names = [entry for entry in inspect.signature(call).parameters if entry != name]
            raise UnknownArgumentError(name, argument_names, where=call.__name__)


def with_settings(options: SimulationOptions, settings: RunSettings) -> SimulationOptions:
    """The options of a diagram, with the settings of a call."""
    return dataclasses.replace(options, **settings) if settings else options
