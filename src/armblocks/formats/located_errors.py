"""Errors of a diagram or a robot with the file and line of the text that they concern."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from armblocks.errors import AlgebraicLoopError, ArmblocksError, DiagramError, FormatError, UnknownNameError
from armblocks.formats.json_document import Node


@contextmanager
def located(node: Node) -> Generator[None]:
    """Add the file and line of a node to errors that are raised inside the ``with`` block."""
    try:
        yield
    except AlgebraicLoopError as error:
        raise AlgebraicLoopError(
            error.loop,
            where=_combined_location(node, error),
            why=error.why,
            allowed=error.allowed,
            fix=error.fix,
        ) from error
    except UnknownNameError as error:
        raise UnknownNameError(
            error.kind, error.name, error.known, where=_combined_location(node, error)
        ) from error
    except DiagramError as error:
        raise DiagramError(
            error.what, where=_combined_location(node, error), allowed=error.allowed, fix=error.fix
        ) from error
    except ArmblocksError as error:
        raise FormatError(
            error.what, where=_combined_location(node, error), allowed=error.allowed, fix=error.fix
        ) from error


def _combined_location(node: Node, error: ArmblocksError) -> str:
    if error.where.startswith(node.where):  # an inner node has added its position
        return error.where
    return f"{node.where}: {error.where}" if error.where else node.where
