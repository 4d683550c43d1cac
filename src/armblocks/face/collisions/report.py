"""The result of a check for collisions."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import counted
from armblocks.face.text_table import text_table
from armblocks.pictures.numbers import table_number

MAX_ROWS = 12


@dataclass(frozen=True, kw_only=True)
class CollisionPair(metaclass=ArgumentErrors):
    """Two bodies: their minimum ``distance`` (m, 0 if they touch) and its ``time``; the first ``contact``.

    Times are in s, or numbers of configurations. ``contact`` is None if the bodies do not touch.
    """

    first: str
    second: str
    distance: float
    time: float
    contact: float | None


@dataclass(frozen=True, kw_only=True)
class CollisionReport(metaclass=ArgumentErrors):
    """Distances along a motion. ``print`` shows the pairs in the order of contact, then of distance.

    - ``name``: the name of the robot.
    - ``samples``: number of checked configurations.
    - ``unit``: the unit of times: ``"s"``, or ``""`` if times are numbers of configurations.
    - ``pairs``: the compared pairs, in this order.
    - ``excluded``: the pairs that are not compared, with reasons, apart from pairs that a joint connects.
    - ``drawn``: links without shapes in their file, whose bodies are the default shapes of the drawing.
    """

    name: str
    samples: int
    unit: str
    pairs: tuple[CollisionPair, ...]
    excluded: tuple[str, ...]
    drawn: tuple[str, ...]

    @property
    def collides(self) -> bool:
        """Whether any two bodies touch."""
        return self.first_contact is not None

    @property
    def first_contact(self) -> CollisionPair | None:
        """The pair that touches first, or None."""
        return self.pairs[0] if self.pairs and self.pairs[0].contact is not None else None

    @property
    def clearance(self) -> float:
        """The smallest distance of all pairs, m; infinite without pairs."""
        return min((pair.distance for pair in self.pairs), default=float("inf"))

    @property
    def summary(self) -> str:
        """The bodies and the time of the first contact, or the minimum distance, as a sentence."""
        first = self.first_contact
        if first is not None and first.contact is not None:
            when = table_number(first.contact)
            at = f"at {when} s" if self.unit else f"in configuration {when}"
            return f"first contact of {first.first} and {first.second} {at}"
        if not self.pairs:
            return "no pair of bodies is compared"
        nearest = min(self.pairs, key=lambda pair: pair.distance)
        return f"no contact, minimum distance {table_number(nearest.distance)} m"

    def __str__(self) -> str:
        rows = [
            [
                f"{pair.first}, {pair.second}",
                table_number(pair.distance),
                table_number(pair.time),
                "" if pair.contact is None else table_number(pair.contact),
            ]
            for pair in self.pairs[:MAX_ROWS]
        ]
        lines = [f"{self.name}: {self.summary}", *text_table(["bodies", "distance", "at", "contact"], rows)]
        if len(self.pairs) > MAX_ROWS:
            lines.append(f"and {counted(len(self.pairs) - MAX_ROWS, 'more pair')}")
        lines += [f"not compared: {text}" for text in self.excluded]
        if self.drawn:
            lines.append(f"bodies from the default drawing: {', '.join(self.drawn)}")
        return "\n".join(lines)
