"""The memory layout of the samples of a batch."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Layout(Enum):
    """The memory layout of the samples of one slot."""

    ROWS = "R"
    """``(N, size)``: one sample after the other, as users pass them."""
    COLUMNS = "C"
    """``(size, N)``: one quantity after the other."""
    SHARED = "S"
    """``(size,)``: the same for all samples (inputs only)."""


@dataclass(frozen=True, kw_only=True)
class BatchLayout:
    """The layouts of all inputs and outputs."""

    inputs: tuple[Layout, ...]
    outputs: tuple[Layout, ...]

    @property
    def key(self) -> str:
        """Short text that identifies the layout."""
        inputs, outputs = (
            "".join(layout.value for layout in layouts) for layouts in (self.inputs, self.outputs)
        )
        return f"{inputs}>{outputs}"

    @classmethod
    def of(cls, key: str) -> BatchLayout:
        """The layout that a key identifies."""
        inputs, outputs = (tuple(Layout(letter) for letter in part) for part in key.split(">"))
        return cls(inputs=inputs, outputs=outputs)
