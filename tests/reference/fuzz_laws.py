"""Laws that hold for every diagram; the fuzzer checks them for random diagrams.

Each law takes a :class:`Case` and yields a text for every contradiction.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from block_formulas import SWITCHING_TOLERANCE, broken_formulas
from fuzz_case import (
    SLOW_REFERENCE,
    TOO_LARGE,
    Case,
    InconclusiveError,
    Signals,
    different,
    rows_beyond,
    rows_of,
)
from fuzz_changes import is_invariant, sensitivities_agree_with_differences, starts_at_any_time
from random_diagrams import RECORD, Recipe
from reference_block import BlockNumbers
from reference_controls import CONTROLS
from reference_simulator import EndlessEventsError, UnsupportedError, run_reference
from well_posed import expect_well_posed, neighbours

import armblocks as ab
from armblocks.blocks import BLOCKS, VariableTransportDelay
from armblocks.diagram import flat_diagram, infer_shapes
from armblocks.errors import ArmblocksError, SimulationError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.formats.diagram_python import diagram_to_python


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
