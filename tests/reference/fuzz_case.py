"""A random diagram with its run, and the comparison of signals."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from random_diagrams import RECORD, Recipe
from reference_simulator import EndlessEventsError, UnsupportedError, run_reference

import armblocks as ab
from armblocks.blocks import DirectLookup
from armblocks.blocks.external_resets import LEVELS
from armblocks.diagram import Diagram, flat_diagram
from armblocks.diagram.controls import EnableControl, TriggerControl

Signals = Mapping[str, np.ndarray]
TOO_LARGE = 1e4
"""A diagram with larger signals counts as unstable, and is not compared."""
SLOW_REFERENCE = 40.0
"""Maximum processor time of a run in the reference simulator, s; slower diagrams are skipped."""


class InconclusiveError(Exception):
    """A case that cannot be checked, with the reason."""


class Case:
    """One diagram and its run, the input of every law."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self.times = recipe.times
        self.diagram = recipe.diagram()
        self.settings: dict[str, Any] = {"stop_time": recipe.stop, "sample_time": RECORD}
        self.run = self.signals(self.diagram)
        self.result_of_run = self.result
        for name, values in self.run.items():
            if not np.isfinite(values).all():
                raise InconclusiveError(f"'{name}' is not finite")
            if np.abs(values).max(initial=0.0) > TOO_LARGE:
                raise InconclusiveError(f"'{name}' is larger than {TOO_LARGE:g}")
            if name.endswith("/angle") and not self.run.get(name[:-5] + "r", np.ones(1)).all():
                raise InconclusiveError(f"'{name}' is the angle of the origin: the signs of zeros decide")

        for name, block in flat_diagram(self.diagram).blocks.items():
            for port in block.input_ports() if isinstance(block, DirectLookup) else ():
                index = self.result[f"{name}/{port.name}"]
                if (np.abs(index - np.rint(index)) < 1e-9)[index != np.rint(index)].any():
                    raise InconclusiveError(f"rounding determines the entry that '{name}' reads")
            if getattr(block, "external_reset", "none") in LEVELS and not block.sampled:
                level = np.ravel(self.result[f"{name}/reset"])
                if level[0] == 0.0 != level[1]:
                    raise InconclusiveError(f"the state of '{name}' may have moved before it is held")

    def signals(self, diagram: Diagram, **settings: Any) -> dict[str, np.ndarray]:
        """Simulate and return the compared signals by path, without those inside conditional subsystems."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = ab.simulate(diagram, **{**self.settings, "rtol": 1e-9, "atol": 1e-12, **settings})
        self.result = result
        return {name: result[name] for name in self.compared(diagram)}

    @staticmethod
    def compared(diagram: Diagram) -> list[str]:
        """Return the paths of all outputs outside conditional subsystems."""
        flat = flat_diagram(diagram)
        return [
            f"{name}/{port.name}"
            for name, block in flat.blocks.items()
            if name not in flat.gates and not isinstance(block, EnableControl | TriggerControl)
            for port in block.output_ports()
        ]

    @cached_property
    def reference(self) -> Signals:
        """The signals of the reference simulator."""
        return self.converged(self.diagram)

    def converged(
        self, diagram: Diagram, times: np.ndarray | None = None, steps: tuple[float, float] = (0.01, 0.004)
    ) -> dict[str, np.ndarray]:
        """Run the reference with two step sizes; the difference is the uncertainty of each signal."""
        try:
            two = run_reference(
                diagram,
                self.times if times is None else times,
                steps[1],
                max_events=300,
                seconds=SLOW_REFERENCE,
            )
            if times is not None:
                return two
            one = run_reference(diagram, self.times, steps[0], max_events=300, seconds=SLOW_REFERENCE)
        except (UnsupportedError, EndlessEventsError, np.linalg.LinAlgError) as error:
            raise InconclusiveError(f"reference: {error}") from None
        for name in self.run:
            if name in two and not np.isfinite(two[name]).all():
                # The native equations are simplified: u / u is 1, even where u is 0.
                raise InconclusiveError(f"reference: '{name}' is not finite")
        self.uncertainty = {name: rows_of(two[name], one[name]) for name in two}
        return two


def rows_of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the largest difference in each row."""
    if len(a) != len(b):
        return np.full(max(len(a), len(b)), np.inf)
    a, b = a.reshape(len(a), -1), b.reshape(len(b), -1)
    return np.abs(a - b).max(axis=1, initial=0.0)


def different(
    actual: Signals, expected: Signals, tolerance: float, excess: Mapping[str, np.ndarray] | None = None
) -> Iterator[str]:
    """Yield every signal that differs by more than ``tolerance`` of its size plus its uncertainty."""
    for name, values in expected.items():
        if name not in actual:
            yield f"'{name}' is missing"
            continue
        other = actual[name]
        if len(other) != len(values):
            yield f"'{name}' has {len(other)} rows instead of {len(values)}"
            continue
        rows = rows_of(other, values)
        size = 1.0 + np.abs(values).max(initial=0.0)
        bound = tolerance * size + (0.0 if excess is None else 10.0 * excess[name])
        if (rows > bound).any():
            row = int(np.argmax(rows > bound))
            count = int((rows > bound).sum())
            values, other = (v.reshape(len(v), -1)[row] for v in (values, other))
            yield f"'{name}' is {other} at row {row} instead of {values} ({count} rows differ)"


def rows_beyond(actual: np.ndarray, expected: np.ndarray, tolerance: float) -> np.ndarray:
    """Return by row whether it is outside the range of the expected row and its neighbours, by ``tolerance``.

    At the time of an event rounding errors decide which of these values a row has.
    """
    if len(actual) != len(expected):
        return np.ones(len(expected), dtype=bool)
    near = tolerance * (1.0 + np.abs(expected).max(initial=0.0))
    rows = np.stack([np.roll(expected, k, axis=0) for k in (-1, 0, 1)])
    rows[0, -1:], rows[2, :1] = expected[-1:], expected[:1]
    is_outside = (actual < rows.min(axis=0) - near) | (actual > rows.max(axis=0) + near)
    return is_outside.reshape(len(is_outside), -1).any(axis=1)
