"""A hash key of everything that a diagram's equations depend on: equal keys mean equal equations.

The disk cache uses the key to find a diagram that an earlier process compiled, without tracing it again. The
key covers the class of each block and the exact values of all parameters: tables, robots, inner diagrams and
the code of Python functions by content. It also covers connections, comments, and the versions of the
libraries. The cache adds the sources of this package. Layout, descriptions and run settings are not part of
the key.

A diagram with unknown content (an external block class, a function that imports a user's module) has no key
and is traced each time.
"""

from __future__ import annotations

import dataclasses
import hashlib
import platform
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, cast

import casadi
import numpy as np

from armblocks.diagram.block import Block
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.function_content import UnknownContentError, function_parts
from armblocks.diagram.levels import levels_of
from armblocks.diagram.port import PortRef
from armblocks.diagram.user_function import UserFunction

_PACKAGE_PREFIX = "armblocks."


def content_key(diagram: Diagram) -> str | None:
    """The key, hexadecimal; ``None`` where the content of the equations cannot be determined."""
    content = _Content()
    try:
        # Inner diagrams first, so that the digests of nested diagrams are known, without recursion.
        for level in reversed(levels_of(diagram).values()):
            content.add(level)
    except UnknownContentError:
        return None
    content.add((casadi.__version__, np.__version__, platform.python_version()))
    return content.digest


class _Content:
    """Digests a sequence of values; lengths separate neighbouring values."""

    def __init__(self) -> None:
        self._texts: list[str] = []
        self._known: dict[int, tuple[object, str]] = {}

    @property
    def digest(self) -> str:
        return hashlib.sha256("\n".join(self._texts).encode()).hexdigest()

    def add(self, value: object) -> None:
        """Add a value by its content. Raises ``UnknownContentError``."""
        if value is None or isinstance(value, bool | int | float | complex):
            # repr of a float is exact, and distinguishes -0.0 from 0.0.
            self._texts.append(f"{type(value).__name__} {value!r}")
        elif isinstance(value, str | bytes):
            self._texts.append(f"{type(value).__name__} {len(value)} {value!r}")
        elif isinstance(value, tuple | list):
            self._add_sequence(cast("Sequence[object]", value))
        elif isinstance(value, Mapping):
            self._add_sequence(tuple(cast("Mapping[object, object]", value).items()), "mapping")
        elif isinstance(value, np.ndarray | np.generic):
            self._add_array(np.asarray(cast("Any", value)))
        elif isinstance(value, Enum):
            self._texts.append(f"enum {_class_name(value)} {value.name}")
        else:
            self._add_object(value)

    def _add_sequence(self, values: Sequence[object], kind: str = "sequence") -> None:
        self._texts.append(f"{kind} {len(values)}")
        for value in values:
            self.add(value)

    def _add_array(self, array: np.ndarray[Any, Any]) -> None:
        if array.dtype.hasobject:
            raise UnknownContentError("an array of objects")
        self._texts.append(f"array {array.dtype.str} {array.shape}")
        self._texts.append(hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest())

    def _add_diagram(self, diagram: Diagram) -> None:
        wires = [(*_port(wire.source), *_port(wire.target)) for wire in diagram.connections]
        gates = [
            (name, sorted((port, *_port(source)) for port, source in gate.items()))
            for name, gate in sorted(diagram.gates.items())
        ]
        comments = sorted(diagram.commented.items())
        names = [(*_port(ref), name) for ref, name in diagram.signal_names.items()]
        lines = [(*_port(line.first), *_port(line.second)) for line in diagram.frame_lines]
        self.add(("diagram", diagram.name, diagram.blocks, wires, lines, gates, comments, names))

    def _add_object(self, value: object) -> None:
        """Digest an object (block, diagram, robot) once: several blocks may share a robot."""
        entry = self._known.get(id(value))
        if entry is None:
            part = _Content()
            part._known = self._known
            part._add_fields(value)
            # The reference keeps the value alive, so that its id stays unique.
            entry = self._known[id(value)] = (value, part.digest)
        self._texts.append(f"object {entry[1]}")

    def _add_fields(self, value: object) -> None:
        if isinstance(value, UserFunction):
            self._add_sequence(function_parts(value.function), "function")
            return
        if isinstance(value, Diagram):
            self._add_diagram(value)
            return
        name = _class_name(value)
        if not dataclasses.is_dataclass(value) or not name.startswith(_PACKAGE_PREFIX):
            raise UnknownContentError(name)
        if isinstance(value, Block):
            self._texts.append(f"block {name}")
            for rule in value.parameters():
                self._texts.append(rule.name)
                self.add(value.parameter_value(rule.name))
            return
        self._texts.append(f"dataclass {name}")
        for field in dataclasses.fields(value):
            if field.compare:
                self._texts.append(field.name)
                self.add(getattr(value, field.name))


def _port(port: PortRef) -> tuple[str, str]:
    return port.block, port.port


def _class_name(value: object) -> str:
    return f"{type(value).__module__}.{type(value).__qualname__}"
