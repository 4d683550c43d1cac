"""Names that are imported when first used, so that ``import armblocks`` costs next to nothing.

A package states its names twice: for type checkers as plain imports under ``TYPE_CHECKING``, and for the
interpreter as a table for :func:`lazy_exports`. A test holds the two against each other.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def lazy_exports(package: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """The module-level ``__getattr__`` (PEP 562) of ``package``.

    ``homes`` says for each name the module that defines it; a name whose home is ``package.name`` is that
    module itself. What has been looked up once is an ordinary attribute from then on.
    """

    def find(name: str) -> object:
        home = homes.get(name)
        if home is None:
            raise AttributeError(f"module '{package}' has no attribute '{name}'", name=name, obj=package)
        module = importlib.import_module(home)
        value: object = module if home == f"{package}.{name}" else getattr(module, name)
        setattr(sys.modules[package], name, value)
        return value

    return find


def shown_by(module: str, function: str) -> Callable[[Any], str]:
    """A method by which a notebook asks a value to show itself: it calls ``function`` of ``module``.

    Descriptions stand below all that draws them and import none of it. They name the function that draws
    them, and it is imported when a notebook asks for the first time.
    """

    def show(self: object) -> str:
        return str(getattr(importlib.import_module(module), function)(self))

    return show
