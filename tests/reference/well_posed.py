"""Whether tiny changes of a diagram, such as rounding errors, change its results."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from fuzz_case import (
    SLOW_REFERENCE,
    Case,
    InconclusiveError,
    Signals,
    different,
    rows_of,
)
from random_diagrams import Node, Recipe
from reference_simulator import EndlessEventsError, UnsupportedError, run_reference

from armblocks.errors import ArmblocksError

SLOW_NEIGHBOURS = 100.0
"""The processor time, s, after which no further changed diagram is compared."""
PERTURBATION, NEIGHBOURS = 1e-9, 8


def expect_well_posed(case: Case, run: Signals) -> None:
    """Raise ``InconclusiveError`` if tiny changes of the diagram explain the difference from the reference.

    If a signal stays at a switching value, or reaches it exactly at a tick, rounding errors decide the
    result. The neighbours are changed diagrams. In some of them, ``PERTURBATION`` with a random sign is added
    to the signals of all connections. In the others, it is added to one signal only, because changes of all
    signals may cause events without end. Rounding also determines whether a signal that passes through 0 is
    exactly 0 at an instant. The first neighbour is therefore the unchanged diagram, in a run in which every
    such signal is 0 for a moment. A signal that touches a switching value may cross it for less than a step
    of the reference. Then the native run of a neighbour agrees with the reference.
    """
    results, begin = [case.reference], time.process_time()
    candidates = [case.recipe, *neighbours(case.recipe), *neighbours_with_one_change(case.recipe)]
    for k, recipe in enumerate(candidates):
        if time.process_time() - begin > SLOW_NEIGHBOURS:
            raise InconclusiveError("the reference is too slow for the changed diagrams")
        with contextlib.suppress(ArmblocksError, UnsupportedError, EndlessEventsError, np.linalg.LinAlgError):
            momentary = recipe is case.recipe
            diagram = recipe.diagram()
            results.append(
                run_reference(
                    diagram, case.times, 0.004, max_events=300, seconds=SLOW_REFERENCE, momentary=momentary
                )
            )
        if k >= NEIGHBOURS and are_explained(case, run, results):
            raise InconclusiveError("a change of the signals by a rounding error changes the result")
    for recipe in candidates[1:]:
        with contextlib.suppress(ArmblocksError):
            if agrees(case, case.signals(recipe.diagram())):
                raise InconclusiveError("a change by a rounding error gives the result of the reference")


def agrees(case: Case, run: Signals) -> bool:
    """Return whether a run agrees with the reference, apart from single rows and tiny changes."""
    reference = {name: case.reference[name] for name in case.run if name in case.reference}
    return not any(different(run, reference, 1e-5, case.uncertainty))


def are_explained(case: Case, run: Signals, results: Sequence[Signals]) -> bool:
    """Return whether results of neighbours explain the difference of a run from the reference.

    They do if the run lies between them, or if they differ from each other where the run first leaves the
    reference.
    """
    is_outside, first, scattered = False, len(case.times), False
    for name in sorted(case.reference.keys() & run.keys()):
        values = np.stack([signals[name] for signals in results])
        lowest, highest = values.min(axis=0), values.max(axis=0)
        margins = 1e-5 * (1.0 + np.abs(values).max(initial=0.0)) + 10.0 * case.uncertainty[name]
        near = margins.reshape(-1, *(1,) * (values.ndim - 2))
        beyond = (run[name] < lowest - near) | (run[name] > highest + near)
        is_outside = is_outside or beyond.reshape(len(beyond), -1).any(axis=1).sum() > 2
        differs = rows_of(run[name], case.reference[name]) > margins
        row = int(np.argmax(differs)) if differs.any() else len(differs)
        if row <= first and row < len(differs):
            scatters = bool((highest - lowest > near)[row].any())
            first, scattered = row, scatters or (scattered and row == first)
    return scattered or not is_outside


def neighbours(recipe: Recipe) -> list[Recipe]:
    """Return diagrams that differ by tiny numbers added on all connections."""
    signs = (
        map(float, np.random.default_rng(seed).choice((-1.0, 1.0), 10_000)) for seed in range(NEIGHBOURS)
    )
    return [
        replace(recipe, nodes=perturbed(recipe.nodes, (PERTURBATION * sign for sign in drawn)))
        for drawn in signs
    ]


def neighbours_with_one_change(recipe: Recipe) -> list[Recipe]:
    """Return diagrams that differ by a tiny number on one connection."""
    numbers = itertools.count()
    perturbed(recipe.nodes, (0.0 * next(numbers) for _ in itertools.count()))
    return [
        replace(
            recipe, nodes=perturbed(recipe.nodes, itertools.chain([0.0] * k, [change], itertools.repeat(0.0)))
        )
        for k in range(next(numbers))
        for change in (-PERTURBATION, PERTURBATION)
    ]


def perturbed(nodes: tuple[Node, ...], changes: Iterator[float]) -> tuple[Node, ...]:
    """Return the diagram with the next of these numbers added on each connection, also in subsystems."""
    changed: list[Node] = []
    for k, node in enumerate(nodes):
        inputs = dict(node.inputs)
        for port, source in node.inputs.items():
            if not is_action(node, source) and (bias := next(changes)):
                name = f"nudge {k} {port}"
                changed.append(Node(name, "Bias", {"bias": bias}, {"u": source}))
                inputs[port] = f"{name}/y"
        changed.append(replace(node, inputs=inputs, inside=perturbed(node.inside, changes)))
    return tuple(changed)


def is_action(node: Node, source: str) -> bool:
    """Return whether a connection carries an action signal, or one of the inputs of a Merge."""
    return node.kind in ("Merge", "ActionSubsystem") or source.split("/")[0].startswith("if ")
