"""Laws about changed diagrams: equivalent diagrams, later starts, changed parameters.

The equivalent diagrams are those of SLforge and SLEMI (Chowdhury et al., ICSE 2018 and 2020), including
equivalence modulo input.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from fuzz_case import (
    Case,
    InconclusiveError,
    different,
    rows_of,
)
from random_diagrams import RECORD, Node, Recipe, block_of
from well_posed import expect_well_posed, is_action

import armblocks as ab
from armblocks.errors import ArmblocksError, SimulationError
from armblocks.face.linearizing import resolved_diagram
from armblocks.face.model import compile_diagram


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
    """A diagram in a subsystem that is enabled later, with its sources delayed alike, has equal signals."""
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
    """The exact derivatives with respect to two parameters agree with differences of runs, and the signals
    with those of the run without derivatives."""
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
    names = [signal for signal in case.run if not signal.endswith("/last")]
    settings = {**case.settings, "rtol": 1e-10, "atol": 1e-13}
    for name in random.choice(numbers, min(2, len(numbers)), replace=False).tolist():
        value = float(system.parameter_values[system.parameters.range_of(name)][0])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = ab.sensitivity(case.diagram, name, names, **settings)
        except SimulationError as error:
            if "the derivative does not exist" in str(error):
                raise InconclusiveError(f"refused: {error}") from None
            undefined = re.search(f"signal '(.+) by {re.escape(name)}' is nan at ([\\d.e+-]+) s", str(error))
            if undefined:
                signal, row = undefined[1], int(np.argmin(np.abs(case.times - float(undefined[2]))))
                if has_kink(differences(case, name, value, settings), signal, row):
                    raise InconclusiveError(f"'{signal}' has no derivative by '{name}'") from None
            yield f"the run with derivatives by '{name}' fails: {error}"
            continue
        except ArmblocksError as error:
            raise InconclusiveError(f"refused: {error}") from None
        beside = {signal: found.run[signal] for signal in names}
        texts = list(different(beside, {signal: case.run[signal] for signal in names}, 1e-6))
        if texts:
            expect_well_posed(case, {**case.run, **beside})
        yield from (f"the run with derivatives by '{name}': {text}" for text in texts)
        for signal, (left, right, wide, central) in differences(case, name, value, settings).items():
            # Where the left, the right and the central differences differ, a jump lies between the runs.
            size = 1.0 + np.abs(wide).max(initial=0.0)
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


def differences(
    case: Case, name: str, value: float, settings: Mapping[str, Any]
) -> dict[str, tuple[np.ndarray, ...]]:
    """The left, right, wide and central difference quotients of each signal by a parameter, from four runs.

    Raises ``InconclusiveError`` if a run is refused or fails.
    """
    step = CHANGE * (1.0 + abs(value))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            runs = [
                ab.simulate(resolved_diagram(case.diagram, {name: value + step * n}, "simulate"), **settings)
                for n in (-2.0, -1.0, 1.0, 2.0)
            ]
    except ArmblocksError as error:
        raise InconclusiveError(f"refused: {error}") from None
    quotients: dict[str, tuple[np.ndarray, ...]] = {}
    for signal in case.run:
        if signal.endswith("/last"):
            continue
        rows = [run[signal] for run in runs]
        if any(len(values) != len(case.times) for values in rows):
            break
        quotients[signal] = (
            (rows[1] - rows[0]) / step,
            (rows[3] - rows[2]) / step,
            (rows[3] - rows[0]) / (4.0 * step),
            (rows[2] - rows[1]) / (2.0 * step),
        )
    return quotients


def has_kink(quotients: Mapping[str, tuple[np.ndarray, ...]], signal: str, row: int) -> bool:
    """Return whether the left and right difference quotients of a signal differ at a row or beside it."""
    if signal not in quotients:
        return False
    left, right = quotients[signal][:2]
    return bool((rows_of(left, right)[max(row - 1, 0) : row + 2] > 1e-2).any())
