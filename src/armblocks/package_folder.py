"""Finds the definitions in the modules of a package's folder, so that a new file needs no registration."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import TypeVar

Kind = TypeVar("Kind")


def modules_in(package: str) -> Iterator[ModuleType]:
    """Import the modules of a package, in alphabetical order; subpackages are not searched."""
    folder = importlib.import_module(package)
    for file in pkgutil.iter_modules(folder.__path__, f"{package}."):
        if not file.ispkg:
            yield importlib.import_module(file.name)


def classes_with(package: str, attribute: str) -> Iterator[tuple[str, str]]:
    """The name and the module of each class in a package that assigns a class attribute.

    The source text is searched instead of imported: importing all blocks takes a fifth of a second, and a
    program uses few of them. The attribute is indented by four spaces, as everywhere in this project.
    """
    folder = importlib.import_module(package)
    line = re.compile(rb"^class (\w+)|^    %b(?::[^=\n]*)? = " % attribute.encode(), re.MULTILINE)
    for path in sorted(file for directory in folder.__path__ for file in Path(directory).glob("*.py")):
        name = b""
        for match in line.finditer(path.read_bytes()):
            if match[1]:
                name = match[1]
            elif name:
                yield name.decode(), f"{package}.{path.stem}"


def values_in(package: str, kind: type[Kind] | tuple[type[Kind], ...]) -> list[Kind]:
    """The values of a kind that the modules of a package have, each once."""
    values: dict[int, Kind] = {}
    for module in modules_in(package):
        values |= {id(value): value for value in vars(module).values() if isinstance(value, kind)}
    return list(values.values())


def classes_in(package: str, base: type[Kind]) -> list[type[Kind]]:
    """The subclasses of a class that the modules of a package define."""
    return [
        value
        for module in modules_in(package)
        for value in vars(module).values()
        if isinstance(value, type) and value.__module__ == module.__name__ and issubclass(value, base)
    ]
