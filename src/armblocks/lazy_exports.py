"""Lazy imports of exported names, so that ``import armblocks`` is fast.

A package lists its names twice: for type checkers as plain imports under ``TYPE_CHECKING``, and for the
interpreter as a table for :func:`lazy_exports`. A test compares the two.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any


def lazy_exports(
    package: str, modules: Mapping[str, str], *, argument_errors: bool = False
) -> Callable[[str], object]:
    """The module-level ``__getattr__`` (PEP 562) of ``package``.

    ``modules`` maps each name to the module that defines it. A name whose module is
    ``package.name`` is that module itself. After the first lookup a name is an ordinary attribute.
    ``argument_errors``: exported functions raise an error for wrong arguments as described in
    :mod:`armblocks.argument_errors`.
    """

    def find(name: str) -> object:
        module_name = modules.get(name)
        if module_name is None:
            raise AttributeError(f"module '{package}' has no attribute '{name}'", name=name, obj=package)
        module = importlib.import_module(module_name)
        value: object = module if module_name == f"{package}.{name}" else getattr(module, name)
        if argument_errors and isinstance(value, FunctionType):
            value = _exported_function(package, value)
        setattr(sys.modules[package], name, value)
        return value

    return find


def _exported_function(package: str, function: FunctionType) -> object:
    """The function with an ``ArgumentError`` for wrong arguments. Pickling stores its name in the package."""
    explained = importlib.import_module("armblocks.argument_errors").with_argument_errors(function)
    explained.__module__ = package
    return explained


def display_method(module: str, function: str) -> Callable[[Any], str]:
    """A notebook display method (``_repr_html_`` and the like) that calls ``function`` of ``module``.

    Description classes belong to a layer below the drawing code and must not import it. They name the drawing
    function, which is imported at the first call.
    """

    def show(self: object) -> str:
        return str(getattr(importlib.import_module(module), function)(self))

    return show
