"""Sample times in the drawing of a diagram: each clock has a colour and a mark; a legend has the periods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from armblocks.diagram import Diagram, sampling_of
from armblocks.equations import SampleClock
from armblocks.pictures.numbers import axis_number, si_prefix
from armblocks.pictures.picture import Picture, Text
from armblocks.pictures.style import SMALL_SIZE, Tone, trace_tone
from armblocks.pictures.text_width import text_width

_ROW = 22.0


@dataclass(frozen=True, eq=False)
class Rates:
    """The clocks of a diagram, fastest first: D1, D2, …

    ``clock_of`` has the index of the clock of each sampled block, by its path in the flat diagram.
    """

    clocks: tuple[SampleClock, ...] = ()
    clock_of: Mapping[str, int] | None = None

    @classmethod
    def of(cls, diagram: Diagram) -> Rates:
        """The clocks of a diagram. Raises ``DiagramError`` if they are not known yet."""
        sampling = sampling_of(diagram)
        return cls(sampling.clocks, sampling.clock_of)

    def mark(self, block: str) -> tuple[str, Tone] | None:
        """Text and colour for a block of this path; ``None`` for a continuous block."""
        number = (self.clock_of or {}).get(block)
        return None if number is None else (f"D{number + 1}", trace_tone(number))

    def add_legend(self, picture: Picture) -> None:
        """Add a line of text below the drawing for every clock."""
        for number, clock in enumerate(self.clocks):
            text = f"D{number + 1}: {_period(clock.period)}"
            if clock.offset:
                text += f", first at {_period(clock.offset)}"
            picture.add(Text(22.0, picture.height + 4, text, SMALL_SIZE, trace_tone(number), bold=True))
            picture.width = max(picture.width, 44.0 + text_width(text, SMALL_SIZE, bold=True))
            picture.height += _ROW


def _period(seconds: float) -> str:
    factor, prefix = si_prefix(seconds)
    return f"{axis_number(float(f'{seconds * factor:.6g}'))} {prefix}s"
