"""The base class of the blocks of mechanics that are neither joints nor solids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from armblocks.diagram import Block
from armblocks.multibody.gathering import gather_mechanisms


@dataclass(frozen=True, kw_only=True)
class MechanicsBlock(Block):
    """Base class of frames, bodies, force elements and sensors of mechanisms.

    A subclass overrides ``frame_ports``, and ``part``, which returns a description of the element
    (:mod:`armblocks.multibody.parts`). The pass :mod:`armblocks.multibody.gathering` converts all parts to
    equations.
    """

    virtual: ClassVar[bool] = True
    gathers: ClassVar[Callable[[Any], Any] | None] = gather_mechanisms
