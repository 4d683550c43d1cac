"""Laws that hold for every diagram; the fuzzer checks them for random diagrams.

Each law takes a :class:`Case` and yields a text for every contradiction. Several laws repeat the run with
changed settings or with an equivalent diagram. The changes are those of SLforge and SLEMI (Chowdhury et al.,
ICSE 2018 and 2020), including equivalence modulo input.
"""

from __future__ import annotations

import contextlib
import itertools
import re
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from block_formulas import SWITCHING_TOLERANCE, broken_formulas
from random_diagrams import RECORD, Node, Recipe, block_of
from reference_block import BlockNumbers
from reference_controls import CONTROLS
from reference_simulator import EndlessEventsError, UnsupportedError, run_reference

import armblocks as ab
from armblocks.blocks import BLOCKS, DirectLookup, VariableTransportDelay
from armblocks.blocks.external_resets import LEVELS
from armblocks.diagram import Diagram, flat_diagram, infer_shapes
from armblocks.diagram.controls import EnableControl, TriggerControl
from armblocks.errors import ArmblocksError, SimulationError
from armblocks.face.linearizing import resolved_diagram
from armblocks.face.model import compile_diagram
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.formats.diagram_python import diagram_to_python

Signals = Mapping[str, np.ndarray]
TOO_LARGE = 1e4
"""A diagram with larger signals counts as unstable, and is not compared."""
SLOW_REFERENCE = 40.0
"""Maximum processor time of a run in the reference simulator, s; slower diagrams are skipped."""


SLOW_NEIGHBOURS = 100.0
"""The processor time, s, after which no further changed diagram is compared."""


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


def agrees_with_reference(case: Case) -> Iterator[str]:
    """The native run agrees with the reference simulator."""
    expected = {name: v for name, v in case.reference.items() if name in case.run}
    if not any(different(case.run, expected, 1e-6, case.uncertainty)):
        return
    # Long steps of the reference are unstable for a stiff block.
    shorter = case.converged(case.diagram, steps=(0.001, 0.0005))
    expected = {name: shorter[name] for name in expected}
    if not any(different(case.run, expected, 1e-6, case.uncertainty)):
        return
    # Where a signal jumps at a recorded time, a single row may have the value just before or just after it.
    beside = case.converged(
        case.diagram, np.unique([0.0, *(case.times - 1e-7), *(case.times + 1e-7)]).clip(0.0)
    )
    texts = list(different(without_single_rows(case.run, expected, beside), expected, 1e-6, case.uncertainty))
    if texts:
        expect_well_posed(case, case.run)
    yield from texts


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


def without_single_rows(actual: Signals, expected: Signals, beside: Signals) -> dict[str, np.ndarray]:
    """Replace a single deviating row by the expected one if it lies between its neighbours in time."""
    changed: dict[str, np.ndarray] = {}
    for name, values in expected.items():
        rows = actual[name].copy()
        deviating = rows_of(rows, values) > 1e-6 * (1.0 + np.abs(values).max(initial=0.0))
        for k in np.flatnonzero(deviating):
            alone = not deviating[max(k - 1, 0) : k].any() and not deviating[k + 1 : k + 2].any()
            # The values of the signal just before, just after, and exactly at this time.
            near = np.concatenate([beside[name][2 * k : 2 * k + 2], values[k : k + 1]])
            margin = 1e-5 * (1.0 + np.abs(near).max(initial=0.0))
            within = (rows[k] >= near.min(axis=0) - margin) & (rows[k] <= near.max(axis=0) + margin)
            if alone and within.all():
                rows[k] = values[k]
        changed[name] = rows
    return changed


def obeys_formulas(case: Case) -> Iterator[str]:
    """At every recorded time the output of a switching block agrees with the formula in NumPy."""
    broken = broken_formulas(case.diagram, case.result_of_run, case.times)
    for name, (row, actual, expected) in broken.items():
        yield f"'{name}' gives {actual:.17g} at row {row}; its formula gives {expected:.17g}"


def obeys_equations(case: Case) -> Iterator[str]:
    """At every recorded time the output of a block without memory solves its equations for its inputs.

    The modes are computed from these inputs only, so that a loop without a solution is detected as well.
    """
    flat = flat_diagram(case.diagram)
    shapes = infer_shapes(flat)
    for name, block in flat.blocks.items():
        if block.sampled or block.differentiated_inputs or block.time_derivatives or name in flat.gates:
            continue
        if type(block) in CONTROLS or block.implicit_outputs:
            continue
        try:
            numbers = BlockNumbers(name, block, shapes.inputs[name], shapes.outputs[name])
        except UnsupportedError:
            continue
        hysteresis_modes = any(f"x:{m.name}" in numbers.needs("mode", m.name) for m in numbers.modes)
        hysteresis_modes = hysteresis_modes or bool(numbers.remembered)
        if numbers.states or numbers.discrete or numbers.lines or hysteresis_modes:
            continue
        yield from contradicted_rows(case, numbers)


def contradicted_rows(case: Case, numbers: BlockNumbers) -> Iterator[str]:
    """Yield the first row of each output that contradicts all inputs within ``SWITCHING_TOLERANCE``."""
    ports = list(numbers.shapes)
    recorded = {port: np.asarray(case.result_of_run[f"{numbers.name}/{port}"]) for port in ports}
    for port in numbers.outputs:
        values = np.asarray(case.result_of_run[f"{numbers.name}/{port}"])
        streak = 0
        for row, t in enumerate(case.times):
            inputs = {p: np.ravel(recorded[p][row]) for p in ports}
            y = np.ravel(values[row])
            exact = fits_equations(numbers, port, y, t, inputs, (0.0,))
            streak = 0 if exact else streak + 1
            # A switching time may be located slightly late, which affects one row; longer deviations are
            # errors.
            is_late = streak < 3 and fits_equations(
                numbers, port, y, t, inputs, (SWITCHING_TOLERANCE, -SWITCHING_TOLERANCE, 0.0)
            )
            if not exact and not is_late:
                yield f"'{numbers.name}/{port}' is {y} at row {row}; its equations differ for {inputs}"
                break


def fits_equations(
    numbers: BlockNumbers, port: str, y: np.ndarray, t: float, inputs: Signals, moves: Sequence[float]
) -> bool:
    """Return whether inputs within small deviations give the output, for every element."""
    size = 1.0 + np.abs(y) + sum(np.abs(u).max(initial=0.0) for u in inputs.values())
    fits = np.zeros(y.shape, dtype=bool)
    numbers.arrays["t"][0] = t
    for chosen in itertools.product(moves, repeat=min(len(inputs), 4)):
        for (name, u), move in itertools.zip_longest(inputs.items(), chosen, fillvalue=0.0):
            # Adding 0 would change the sign of -0, on which the angle of a point depends.
            numbers.arrays[f"u:{name}"][:] = u + move * (1.0 + np.abs(u)) if move else u
        numbers.update_modes()
        expected = numbers.value("out", port)
        fits |= (
            np.abs(y - expected) <= 4 * SWITCHING_TOLERANCE * size * (10.0 if any(moves) else 1.0)
        ) | ~np.isfinite(expected)
        if fits.all():
            return True
    return False


def obeys_formulas_at_default_tolerances(case: Case) -> Iterator[str]:
    """The law of ``obeys_formulas`` for a run at the default tolerances."""
    case.signals(case.diagram, rtol=1e-6, atol=1e-9)
    for name, (row, actual, expected) in broken_formulas(case.diagram, case.result, case.times).items():
        yield f"'{name}' gives {actual:.17g} at row {row}; its formula gives {expected:.17g}"


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


def converges(case: Case) -> Iterator[str]:
    """A run at the default tolerances is close to one at tight tolerances, except at shifted event times."""
    loose_run = case.signals(case.diagram, rtol=1e-6, atol=1e-9)
    for name, values in case.run.items():
        deviating = rows_beyond(loose_run[name], values, 2e-3)
        if deviating.sum() > max(2, len(deviating) // 10):
            expect_well_posed(case, loose_run)
            row = int(np.argmax(deviating))
            yield f"'{name}' differs in {deviating.sum()} rows between tolerances, first at row {row}"


def agrees_with_fixed_steps(case: Case) -> Iterator[str]:
    """The fixed-step solver, which also locates events, agrees up to the error of its steps."""
    deviating: dict[str, np.ndarray] = {}
    for step in (0.002, 0.0004):  # jumps through a variable delay have errors of first order
        fixed = case.signals(case.diagram, solver="rk4", step=step)
        rows = {name: rows_beyond(fixed[name], values, 1e-3) for name, values in case.run.items()}
        deviating = {
            name: differs for name, differs in rows.items() if differs.sum() > max(2, len(differs) // 10)
        }
        if not deviating:
            return
    expect_well_posed(case, fixed)
    for name, differs in deviating.items():
        row = int(np.argmax(differs))
        yield f"'{name}' differs in {differs.sum()} rows with fixed steps, first at row {row}"


def repeats(case: Case) -> Iterator[str]:
    """A repeated run has the same bits, also of the saved, exported or differently compiled diagram."""
    yield from same_bits("again", case.signals(case.diagram), case.run)
    loaded = diagram_from_bytes(diagram_to_bytes(case.diagram, load_robot), "fuzz", BLOCKS, load_robot)
    if loaded != case.diagram:
        yield "the loaded diagram differs from the saved one"
    yield from same_bits("loaded", case.signals(loaded), case.run)
    text = diagram_to_python(case.diagram)
    scope: dict[str, Any] = {}
    exec(text[: text.index("result = ")], scope)  # noqa: S102 - the code was generated above
    yield from same_bits("exported", case.signals(scope["diagram"]), case.run)
    for effort in ("little", "full"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("ARMBLOCKS_EFFORT", effort)
            yield from same_bits(f"compiled with {effort} effort", case.signals(case.diagram), case.run)


def same_bits(change: str, actual: Signals, expected: Signals) -> Iterator[str]:
    for name, values in expected.items():
        if name not in actual or not np.array_equal(actual[name], values):
            yield f"{change}: '{name}' has other bits"


def continues(case: Case) -> Iterator[str]:
    """A run with pauses, and one that continues from a saved state, give the same bits."""
    settings = {**case.settings, "rtol": 1e-9, "atol": 1e-12}
    run = ab.begin(case.diagram, **settings)
    while not run.finished:
        run.advance(steps=7)
    result = run.result()
    yield from same_bits("with pauses", {name: result[name] for name in case.run}, case.run)
    middle = round(case.recipe.stop / RECORD / 2) * RECORD
    first = ab.simulate(case.diagram, **{**settings, "stop_time": middle})
    later = ab.simulate(case.diagram, **settings, initial_state=first.final_state)
    row = int(np.argmin(np.abs(case.times - later.time[0])))
    rest = {name: values[row:] for name, values in case.run.items()}
    yield from same_bits("continued", {name: later[name] for name in rest}, rest)


def is_invariant(case: Case) -> Iterator[str]:
    """Renaming, reordering, wrapping, dead blocks, unit gains and added zeros do not change the signals."""
    for title, change in CHANGES.items():
        recipe, names = change(case.recipe)
        try:
            diagram = recipe.diagram()
        except ArmblocksError as error:
            yield f"{title}: refused, {error}"
            continue
        changed = case.signals(diagram)
        renamed = {name: changed[names(name)] for name in case.run if names(name) in changed}
        expected = {name: case.run[name] for name in renamed}
        texts = list(different(renamed, expected, 1e-6))
        if texts:
            expect_well_posed(case, {**case.run, **renamed})
        yield from (f"{title}: {text}" for text in texts)


Change = Callable[[Recipe], tuple[Recipe, Callable[[str], str]]]


def same(name: str) -> str:
    return name


def renamed(recipe: Recipe) -> tuple[Recipe, Callable[[str], str]]:
    """Rename the blocks such that their sorted order is reversed."""
    names = {node.name: f"{chr(122 - k % 26)}{k} {node.name}" for k, node in enumerate(recipe.nodes)}

    def ref(text: str) -> str:
        first, _, rest = text.partition("/")
        return f"{names[first]}/{rest}"

    nodes = tuple(
        replace(n, name=names[n.name], inputs={p: ref(s) for p, s in n.inputs.items()}) for n in recipe.nodes
    )
    return replace(recipe, nodes=nodes), ref


def reordered(recipe: Recipe) -> tuple[Recipe, Callable[[str], str]]:
    return replace(recipe, nodes=recipe.nodes[::-1]), same


def wrapped(recipe: Recipe) -> tuple[Recipe, Callable[[str], str]]:
    """Put all blocks into a subsystem."""
    return replace(
        recipe, nodes=(Node("whole", "Subsystem", {}, {}, recipe.nodes),)
    ), lambda name: f"whole/{name}"


def with_dead_blocks(recipe: Recipe) -> tuple[Recipe, Callable[[str], str]]:
    dead: list[Node] = []
    for k, node in enumerate(recipe.nodes):
        sources = list(node.inputs.values())
        if sources and k % 3 == 0:
            dead += [Node(f"dead {k}", "Gain", {"gain": 2.0}, {"u": sources[0]})]
            dead += [Node(f"end {k}", "Terminator", {}, {"u": f"dead {k}/y"})]
    return replace(recipe, nodes=(*dead, *recipe.nodes)), same


def through(kind: str, parameters: Mapping[str, Any]) -> Change:
    """Return a change that inserts a block without effect before the inputs of some blocks."""

    def change(recipe: Recipe) -> tuple[Recipe, Callable[[str], str]]:
        nodes: list[Node] = []
        for k, node in enumerate(recipe.nodes):
            inputs = dict(node.inputs)
            for port, source in node.inputs.items():
                if k % 2 == 0 and not is_action(node, source):
                    name = f"through {k} {port}"
                    nodes.append(Node(name, kind, parameters, {"u": source}))
                    inputs[port] = f"{name}/y"
            nodes.append(replace(node, inputs=inputs))
        return replace(recipe, nodes=tuple(nodes)), same

    return change


CHANGES: Mapping[str, Change] = {
    "renamed": renamed,
    "reordered": reordered,
    "wrapped": wrapped,
    "with dead blocks": with_dead_blocks,
    "through unit gains": through("Gain", {"gain": 1.0}),
    "with zeros added": through("Bias", {"bias": -0.0}),
}

LATER = 6.0
"""The time of a later start, s: a multiple of all tick periods."""
ABSOLUTE = ("CTraj", "JTraj", "TransportDelay", "VariableTimeDelay", "VariableTransportDelay")
"""Blocks that depend on the time, or that keep their history at a restart."""
ENABLED = {
    "restarted": ("reset", {"period": LATER, "width": 60.0}),
    "enabled for the first time": ("held", {"period": LATER, "width": 60.0, "delay": LATER}),
}
"""The states of a subsystem when it is enabled, and the pulses that enable it for 3.6 s from ``LATER`` on."""


def starts_at_any_time(case: Case) -> Iterator[str]:
    """A diagram in a subsystem that starts later, with sources that are later as well, has equal signals."""
    recipe = replace(case.recipe, nodes=tuple(map(periodic, case.recipe.nodes)))
    try:
        periodic_case = case if recipe == case.recipe else Case(recipe)
    except SimulationError as error:
        raise InconclusiveError(f"with changed periods: {error}") from None
    expected_run = periodic_case.run
    nodes = tuple(map(later, recipe.nodes))
    end = Node("end", "Outport", {}, {"u": next(name for name in expected_run if name.count("/") == 1)})
    for title, (states, pulses) in ENABLED.items():
        enabling = Node("enabling", "PulseGenerator", pulses)
        parameters = {"states_when_enabling": states}
        whole = Node("whole", "EnabledSubsystem", parameters, {"enable": "enabling/y"}, (*nodes, end))
        wrapped = Recipe((enabling, whole), LATER + recipe.stop)
        try:
            case.signals(wrapped.diagram(), stop_time=wrapped.stop)
        except SimulationError as error:
            time_of_failure = re.search(r"at ([\d.e+-]+) s", str(error))
            if states == "reset" and time_of_failure and float(time_of_failure[1]) < LATER:
                raise InconclusiveError(f"before the restart: {error}") from None
            raise
        rows = slice(round(LATER / RECORD), None)
        names = [name for name in expected_run if not name.endswith("/last")]
        actual = {name: case.result[f"whole/{name}"][rows] for name in names}
        texts = list(different(actual, {name: expected_run[name] for name in names}, 1e-6))
        if texts:
            expect_well_posed(periodic_case, actual)
        yield from (f"{title}: {text}" for text in texts)


def periodic(node: Node) -> Node:
    """The node with periods that divide ``LATER``, without an offset of ticks or the time of a crossing."""
    changed = dict(node.parameters)
    if isinstance(changed.get("sample_time"), tuple):
        changed["sample_time"] = changed["sample_time"][0]
    if node.kind == "SignalGenerator":
        changed["frequency"] = max(1, round(LATER * changed.get("frequency", 1.0))) / LATER
        changed["units"] = "Hz"
    elif node.kind in ("FirstOrderHold", "PWM"):
        changed["period"] = LATER / round(LATER / changed.get("period", 0.1))
        changed["offset"] = 0.0
    inputs = {port: re.sub("/last$", "/count", source) for port, source in node.inputs.items()}
    return replace(node, parameters=changed, inputs=inputs, inside=tuple(map(periodic, node.inside)))


def later(node: Node) -> Node:
    """The node in a diagram that starts at ``LATER``. Raises ``InconclusiveError`` for absolute times."""
    kind, shifted = node.kind, dict(node.parameters)
    block = None if node.inside else block_of(node)
    starts = {"Step": "time", "Pulse": "start", "PulseGenerator": "delay", "Ramp": "start"}
    if kind == "Clock":
        kind, shifted = "Ramp", {"start": LATER}
    elif kind in starts:
        shifted[starts[kind]] = block.parameter_value(starts[kind]) + LATER
    elif kind == "SineWave":
        w, phase = (np.asarray(block.parameter_value(name)) for name in ("frequency", "phase"))
        shifted["phase"] = (phase - w * LATER).tolist()
    elif kind in ABSOLUTE:
        raise InconclusiveError(f"'{node.name}' depends on the time or the past")
    return replace(node, kind=kind, parameters=shifted, inside=tuple(map(later, node.inside)))


CHANGE = 1e-6
"""The change of a parameter for a difference of runs, relative to 1 plus its value."""


def sensitivities_agree_with_differences(case: Case) -> Iterator[str]:
    """The exact derivatives with respect to one parameter agree with differences of runs."""
    system = compile_diagram(case.diagram).system
    numbers = [
        slot.name
        for slot in system.parameters.slots
        if slot.shape == ()
        and np.isfinite(system.parameter_values[system.parameters.range_of(slot.name)]).all()
    ]
    random = np.random.default_rng(
        len(case.recipe.nodes) + round(1e6 * abs(sum(map(np.sum, case.run.values()))))
    )
    if not numbers:
        raise InconclusiveError("no parameter is a number")
    for name in random.choice(numbers, min(2, len(numbers)), replace=False).tolist():
        value = float(system.parameter_values[system.parameters.range_of(name)][0])
        settings = {**case.settings, "rtol": 1e-10, "atol": 1e-13}
        names = [signal for signal in case.run if not signal.endswith("/last")]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    found = ab.sensitivity(case.diagram, name, names, **settings)
                except SimulationError as error:
                    if "coincide" not in str(error):
                        yield f"the run with derivatives by '{name}' fails: {error}"
                        continue
                    raise
                runs = [
                    ab.simulate(resolved_diagram(case.diagram, {name: value + shift}), **settings)
                    for shift in CHANGE * (1.0 + abs(value)) * np.array([-2.0, -1.0, 1.0, 2.0])
                ]
        except ArmblocksError as error:
            raise InconclusiveError(f"refused: {error}") from None
        step = CHANGE * (1.0 + abs(value))
        for signal in names:
            rows = [run[signal] for run in runs]
            if any(len(values) != len(case.times) for values in rows):
                break
            # Where the left, the right and the central differences differ, a jump lies between the runs.
            left, right, wide = (
                (rows[1] - rows[0]) / step,
                (rows[3] - rows[2]) / step,
                (rows[3] - rows[0]) / (4.0 * step),
            )
            central, size = (rows[2] - rows[1]) / (2.0 * step), 1.0 + np.abs(wide).max(initial=0.0)
            spread = np.max([rows_of(other, central) for other in (left, right, wide)], axis=0)
            smooth = spread < 1e-3 * size
            wrong = smooth & (rows_of(found[signal, name], central) > 1e-2 * size)
            if wrong.sum() > 2 and size < 1e5:
                row = int(np.argmax(wrong))
                derivative = np.ravel(found[signal, name][row])
                yield (
                    f"d '{signal}' / d '{name}' is {derivative} at row {row}; the differences of runs give "
                    f"{np.ravel(central[row])} ({wrong.sum()} rows differ)"
                )


LAWS: Mapping[str, Callable[[Case], Iterator[str]]] = {
    "reference": agrees_with_reference,
    "formulas": obeys_formulas,
    "equations": obeys_equations,
    "formulas at default tolerances": obeys_formulas_at_default_tolerances,
    "tolerances": converges,
    "fixed steps": agrees_with_fixed_steps,
    "repetition": repeats,
    "continuation": continues,
    "invariance": is_invariant,
    "later start": starts_at_any_time,
    "sensitivities": sensitivities_agree_with_differences,
}


def failure(recipe: Recipe, message: str) -> dict[str, list[str]]:
    """A run that fails is a finding if the reference reaches the stop time with finite signals.

    The reference signals must also agree with those of shorter steps, because fixed steps can cross a pole.
    The values after the pole then depend on the step; additional rows after the stop time show the
    difference. A limited state hides the difference, but near the time of the failure a signal is large.
    """
    times = np.concatenate([recipe.times, recipe.times[-1] + RECORD * np.arange(1, 6)])
    try:
        result, finer = (
            run_reference(recipe.diagram(), times, step, max_events=300, seconds=SLOW_REFERENCE)
            for step in (0.004, 0.0011)
        )
    except (UnsupportedError, EndlessEventsError, np.linalg.LinAlgError) as error:
        raise InconclusiveError(f"{message}; reference: {error}") from None
    for name, values in result.items():
        if name.endswith("/angle") and not result.get(name[:-5] + "r", np.ones(1)).all():
            raise InconclusiveError(f"'{name}' is the angle of the origin, which has no derivative")
        if not np.isfinite(values).all():
            raise InconclusiveError(f"'{name}' is not finite in the reference either")
        beyond = rows_beyond(values, finer[name], 1e-2)
        if np.count_nonzero(beyond) > 1:
            raise InconclusiveError(f"'{name}' depends on the steps of the reference")
    stop_of_run = re.search(r"at ([\d.e+-]+) s", message)
    if stop_of_run:
        offsets = 10.0 ** -np.arange(2.0, 10.0)
        near = float(stop_of_run[1]) + np.concatenate([-offsets, offsets[::-1]])
        times = np.concatenate([[0.0], near[near > 0.0]])
        rows = run_reference(recipe.diagram(), times, 0.004, max_events=300, seconds=SLOW_REFERENCE)
        for name, values in rows.items():
            if not np.abs(values).max(initial=0.0) < TOO_LARGE:
                raise InconclusiveError(f"'{name}' has a pole at {stop_of_run[1]} s")
    flat = flat_diagram(recipe.diagram())
    pole = re.search("the derivative of state '(.+)/delay' is not finite", message)
    if pole and isinstance(flat.blocks[pole[1]], VariableTransportDelay):
        raise InconclusiveError(f"{message}; a transit time of 0 ends the run")
    loop = re.search("no choice of the modes of (?:block|the blocks) '(.+?)'", message)
    if loop and loop[1] in flat.gates:
        raise InconclusiveError(
            f"{message}; comparisons are evaluated while their subsystem is disabled, too"
        )
    stalled = re.search("block '(.+?)' causes events without end", message)
    if stalled and getattr(flat.blocks.get(stalled[1]), "relation", "") in ("==", "~="):
        raise InconclusiveError(f"{message}; the relation holds at one instant, which short steps pass over")
    is_stalled = "events without end" in message or "extremely short steps" in message
    if is_stalled and all(runs(neighbour) for neighbour in neighbours(recipe)):
        raise InconclusiveError(f"{message}; rounding errors cause the events or steps")
    return {"runs": [message]}


def runs(recipe: Recipe) -> bool:
    """Return whether a native run reaches the stop time."""
    try:
        Case(recipe)
    except InconclusiveError:
        return True
    except ArmblocksError:
        return False
    return True


def failing(case: Case, law: Callable[[Case], Iterator[str]]) -> Iterator[str]:
    """Yield the contradictions of a law, or a failed run if the reference is finite."""
    try:
        yield from law(case)
    except SimulationError as error:
        if case.reference:  # raises InconclusiveError if it is not finite
            yield f"fails: {error}"


def findings(recipe: Recipe, laws: Sequence[str] = tuple(LAWS)) -> dict[str, list[str]]:
    """Return contradictions by law; raise ``InconclusiveError`` if nothing can be compared."""
    try:
        case = Case(recipe)
    except SimulationError as error:
        return failure(recipe, str(error))
    texts_by_law: dict[str, list[str]] = {}
    for name in laws:
        try:
            texts = list(failing(case, LAWS[name]))
        except InconclusiveError as error:
            texts_by_law.setdefault("inconclusive", []).append(f"{name}: {error}")
            continue
        if texts:
            texts_by_law[name] = texts
    return texts_by_law
