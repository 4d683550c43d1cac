"""Errors of calls whose arguments do not fit the signature.

Python's TypeError for such a call does not list the valid names. Public classes have the metaclass
:class:`ArgumentErrors`, which raises :class:`~armblocks.errors.ArgumentError` instead, also in their public
methods. :func:`with_argument_errors` is the corresponding decorator of functions. An ``ArgumentError`` is a
TypeError, too.
"""

from __future__ import annotations

import functools
import inspect
import types
from abc import ABCMeta
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast
from weakref import WeakSet

from armblocks.errors import ArgumentError, UnknownArgumentError, counted, shortened_list

MAX_EXAMPLE = 2
"""Maximum number of arguments in the call that a message suggests."""

Instance = TypeVar("Instance")
Function = TypeVar("Function", bound=Callable[..., object])
_PLAIN_METHODS: WeakSet[type] = WeakSet()
"""Classes whose methods only the package calls."""


class ArgumentErrors(ABCMeta):
    """Metaclass of public classes: wrong arguments of the constructor and of public methods raise an
    ``ArgumentError``.

    ``methods=False`` excludes the methods of a class and its subclasses, if only the package calls them.
    """

    def __new__(
        mcs, name: str, bases: tuple[type, ...], members: dict[str, Any], *, methods: bool = True
    ) -> ArgumentErrors:
        excluded = {cls for base in bases for cls in base.__mro__ if cls in _PLAIN_METHODS}
        if methods and not excluded:
            members = {key: _checked(key, member) for key, member in members.items()}
        cls = super().__new__(mcs, name, bases, members)
        if not methods:
            _PLAIN_METHODS.add(cls)
        return cls

    def __call__(cls: type[Instance], *values: Any, **named: Any) -> Instance:
        try:
            return cast("Instance", type.__call__(cls, *values, **named))
        except TypeError:
            check_arguments(cls, values, named)
            raise

    @property
    def __signature__(cls) -> inspect.Signature:
        """The signature of the constructor. By default ``inspect.signature`` of a class with a metaclass
        returns the signature of ``__call__``.
        """
        return inspect.signature(types.MethodType(cls.__init__, cls))


def with_argument_errors(function: Function) -> Function:
    """The function with an ``ArgumentError`` for wrong arguments, instead of Python's TypeError."""

    @functools.wraps(function)
    def call(*values: object, **named: object) -> object:
        try:
            return function(*values, **named)
        except TypeError:
            check_arguments(function, values, named)
            raise

    return cast("Function", call)


def _checked(name: str, member: Any) -> Any:
    """A member of a class; a public method raises an ``ArgumentError`` for wrong arguments."""
    if name.startswith("_"):
        return member
    if isinstance(member, types.FunctionType):
        return _method(member)
    if isinstance(member, classmethod):
        return classmethod(_method(cast("classmethod[Any, ..., Any]", member).__func__))
    if isinstance(member, staticmethod):
        return staticmethod(with_argument_errors(cast("staticmethod[..., Any]", member).__func__))
    return member


def _method(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, whose first argument is an object or class, with an ``ArgumentError`` in a call."""

    @functools.wraps(function)
    def call(*values: Any, **named: Any) -> Any:
        try:
            return function(*values, **named)
        except TypeError:
            if values:
                check_arguments(types.MethodType(function, values[0]), values[1:], named)
            raise

    return call


def check_arguments(
    call: Callable[..., object], values: Sequence[object], named: Mapping[str, object]
) -> None:
    """Raise an ``ArgumentError`` if the arguments do not fit the signature of a function or class.

    The error names an unknown argument with the nearest known one, superfluous positional arguments, an
    argument that is given twice, or all missing arguments.
    """
    name, signature = call.__name__, inspect.signature(call)
    try:
        signature.bind(*values, **named)
    except TypeError:
        raise _argument_error(name, signature, _shown_names(call, signature), values, named) from None


def _shown_names(call: Callable[..., object], signature: inspect.Signature) -> list[str]:
    """The names of the arguments, without internal fields, which are optional and have ``repr=False``."""
    fields: Mapping[str, Any] = getattr(call, "__dataclass_fields__", {})
    return [
        name
        for name, entry in signature.parameters.items()
        if entry.kind not in (entry.VAR_POSITIONAL, entry.VAR_KEYWORD)
        and (name not in fields or fields[name].repr or entry.default is entry.empty)
    ]


def _argument_error(
    name: str,
    signature: inspect.Signature,
    shown: Sequence[str],
    values: Sequence[object],
    named: Mapping[str, object],
) -> ArgumentError:
    parameters = signature.parameters
    for argument in named:
        if argument not in parameters:
            return UnknownArgumentError(argument, shown, where=name)
    positional = [
        argument for argument, entry in parameters.items() if entry.kind is entry.POSITIONAL_OR_KEYWORD
    ]
    required = [argument for argument in shown if parameters[argument].default is inspect.Parameter.empty]
    given = {*positional[: len(values)], *named}
    repeated = [argument for argument in positional[: len(values)] if argument in named]
    if len(values) > len(positional):
        what = f"{counted(len(values), 'argument is', 'arguments are')} given without names"
    elif repeated:
        what = f"the argument '{repeated[0]}' is given twice"
    else:
        missing = [argument for argument in required if argument not in given]
        what = f"{counted(len(missing), 'argument is', 'arguments are')} missing: {shortened_list(missing)}"
    by_name = [argument for argument in shown if argument not in positional]
    allowed = [
        f"{how} {shortened_list(names)}"
        for how, names in (("by position or name:", positional), ("by name:", by_name))
        if names
    ]
    example = ", ".join(f"{argument}=…" for argument in (required or shown[:1])[:MAX_EXAMPLE])
    example += ", …" * (len(required) > MAX_EXAMPLE)
    return ArgumentError(
        what,
        where=name,
        allowed="; ".join(allowed) or "no arguments",
        fix=f"write {name}({example})",
    )
