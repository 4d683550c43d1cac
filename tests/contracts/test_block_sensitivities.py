"""Sensitivities to the tunable parameters of every block, compared with differences of runs.

A case is the worked example of a block with random parameters: unchanged, with the block in an enabled
subsystem, or with a delay after it. Each output is integrated, and the integrals are differentiated. The
default is a short list of cases; the environment variable ``ARMBLOCKS_LONG=seed`` runs all.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

import armblocks as ab
from armblocks.blocks import BLOCKS, EnabledSubsystem, Inport, Integrator, Outport, SineWave, TransportDelay
from armblocks.diagram import Block, Diagram, DiagramBuilder, PortRef
from armblocks.errors import ArmblocksError, InputError, SimulationError
from armblocks.face.block_examples import block_name

SETTINGS = {"rtol": 1e-10, "atol": 1e-11, "stop_time": 3.0, "sample_time": 3.0 / 37.3, "solver": "rk45"}
SURROUNDINGS = ("plain", "enabled", "delayed")
SHORT = (
    ("FirstOrderHold", "plain"),
    ("PWM", "delayed"),
    ("SignalGenerator", "enabled"),
    ("SecondOrderIntegratorLimited", "plain"),
    ("DiscreteIntegrator", "delayed"),
    ("VariableTimeDelay", "plain"),
    ("Relay", "enabled"),
    ("StickSlipFriction", "plain"),
    ("PID", "enabled"),
)
LONG = os.environ.get("ARMBLOCKS_LONG", "")
SEED = int(LONG) if LONG.isdigit() else 1
CASES = [(kind, surroundings) for kind in sorted(BLOCKS) for surroundings in SURROUNDINGS] if LONG else SHORT
REASONS = (
    "is a table that is read by index",
    "acts only through comparisons or its integer part",
    "at the start moves with the parameter",
    "are in one diagram",
    "calls Python, which has no derivatives",
    "several events coincide at",
    "is exactly at a limit or at a jump after",
)

Array = NDArray[np.float64]


def with_perturbed_parameters(block: Block, random: np.random.Generator) -> Block:
    """Return the block with random changes of its tunable parameters where these are valid."""
    for rule in block.own_parameters():
        value = np.asarray(block.parameter_value(rule.name)) if rule.tunable else np.array("")
        if value.dtype.kind == "f" and np.isfinite(value).all():
            try:
                changed = value * (1.0 + 0.15 * random.uniform(-1.0, 1.0, value.shape))
                block = block.with_parameters(**{rule.name: changed if value.ndim else float(changed)})
            except ArmblocksError:
                continue  # the parameter cannot change alone
    return block


def enabled_subsystem(name: str, block: Block) -> Block:
    """An enabled subsystem that contains the named block and has ports of the same names."""
    inside = DiagramBuilder("inside")
    inside.add(name, block)
    for port in block.input_ports():
        inside.connect(inside.add(port.name, Inport()), PortRef(name, port.name))
    for port in block.output_ports():
        inside.connect(PortRef(name, port.name), inside.add(f"{port.name} out", Outport()))
    return EnabledSubsystem(diagram=inside.build())


def case(kind: str, surroundings: str, seed: int) -> tuple[Diagram, str, Sequence[str]]:
    """Return the diagram, the path of the block, and the integrals of its outputs."""
    random = np.random.default_rng([seed, *map(ord, kind + surroundings)])
    example, name = ab.block_example(kind), block_name(BLOCKS[kind])
    builder = DiagramBuilder("case")
    shown = [other for other, block in example.blocks.items() if block.views() and other != name]
    for other, block in example.blocks.items():
        if other not in shown:
            changed = with_perturbed_parameters(block, random)
            builder.add(
                other,
                enabled_subsystem(name, changed) if (other, surroundings) == (name, "enabled") else changed,
            )
    if surroundings == "enabled":
        control = SineWave(frequency=1.7, bias=0.31, phase=0.4)
        builder.connect(builder.add("control", control), PortRef(name, "enable"))

    def source(end: PortRef) -> PortRef:
        return PortRef(name, f"{end.port} out") if (end.block, surroundings) == (name, "enabled") else end

    for wire in example.connections:
        if wire.target.block not in shown:
            builder.connect(source(wire.source), wire.target)
    integrals: list[str] = []
    for port in example.blocks[name].output_ports():
        last = source(PortRef(name, port.name))
        if surroundings == "delayed":
            last = builder.add(f"late {port.name}", TransportDelay(delay=0.37), last)
        integrals.append(builder.add(f"integral of {port.name}", Integrator(), last).name)
    return builder.build(), f"{name}/{name}" if surroundings == "enabled" else name, integrals


def differences(
    diagram: Diagram, parameter: str, value: Array, direction: Array, step: float, outputs: Sequence[str]
) -> Iterator[list[tuple[Array, Array]]]:
    """Yield for each output the extrapolated differences along a direction, and their uncertainty.

    First central differences, then one-sided ones: at a kink, such as the limit of a limiter, the derivative
    is one-sided.
    """

    def run(change: float) -> list[Array]:
        result = ab.simulate(diagram, parameters={parameter: value + change * direction}, **SETTINGS)
        return [result[output] for output in outputs]

    steps = (step, 0.5 * step, 0.25 * step)
    above, below = [run(h) for h in steps], [run(-h) for h in steps]
    yield extrapolated_differences(
        [[(a - b) / (2.0 * h) for a, b in zip(*ends)] for h, *ends in zip(steps, above, below)], 4
    )
    unchanged = run(0.0)
    for side, ends in ((1.0, above), (-1.0, below)):
        yield extrapolated_differences(
            [[(a - b) / (side * h) for a, b in zip(end, unchanged)] for h, end in zip(steps, ends)], 2
        )


def extrapolated_differences(plain: Sequence[Sequence[Array]], ratio: int) -> list[tuple[Array, Array]]:
    """Return the limit of differences whose errors decrease by ``ratio`` per step, and its uncertainty."""
    estimates: list[tuple[Array, Array]] = []
    for rows in zip(*plain):
        first, second = ((ratio * fine - coarse) / (ratio - 1) for coarse, fine in pairwise(rows))
        estimates.append((second, np.abs(second - first) + 0.05 * np.abs(rows[-1] - second)))
    return estimates


def derivatives_agree(
    diagram: Diagram, result: ab.SensitivityResult, parameter: str, value: Array, outputs: Sequence[str]
) -> bool:
    """Return whether the derivatives agree with the differences, or no differences can be computed."""
    random = np.random.default_rng(len(parameter))
    direction = random.uniform(0.5, 1.0, value.shape) * np.maximum(np.abs(value), 0.1)
    compared_outputs = False
    for step in (1e-3, 1e-5):
        try:
            for compared in differences(diagram, parameter, value, direction, step, outputs):
                compared_outputs, wrong = True, False
                for output, (expected, uncertainty) in zip(outputs, compared):
                    actual = result[output, parameter].reshape(*expected.shape, -1) @ direction.ravel()
                    bound = 1e-4 * (0.05 + np.abs(expected).max()) + 10.0 * uncertainty
                    wrong |= bool((~(np.abs(actual - expected) <= bound)).any())
                if not wrong:
                    return True
        except ArmblocksError:
            continue  # a changed parameter is outside its bounds
    return not compared_outputs


@pytest.mark.parametrize(("kind", "surroundings"), CASES)
def test_sensitivities_agree_with_differences_of_runs(kind: str, surroundings: str) -> None:
    try:
        diagram, path, outputs = case(kind, surroundings, SEED)
        ab.simulate(diagram, **SETTINGS)
    except ArmblocksError:
        assert LONG, "a case of the short list cannot be built or run"
        pytest.skip("the case cannot be built or run")
    system = ab.compile_diagram(diagram).system
    values = system.parameters.unpack(system.parameter_values)
    names = [
        slot.name
        for slot in system.parameters
        if slot.name.rpartition(".")[0] == path and slot.size <= 12 and np.isfinite(values[slot.name]).all()
    ]
    for result in sensitivities(diagram, names, outputs):
        for name in result.parameters:
            assert derivatives_agree(diagram, result, name, np.asarray(values[name]), outputs), name


def sensitivities(
    diagram: Diagram, names: Sequence[str], outputs: Sequence[str]
) -> Iterator[ab.SensitivityResult]:
    """Yield the sensitivities to all parameters at once, or to single parameters where some are refused."""
    if not names or not outputs:
        return
    try:
        yield ab.sensitivity(diagram, names, outputs, **SETTINGS)
    except (InputError, SimulationError) as error:
        assert any(reason in error.what for reason in REASONS), error
        for name in names if len(names) > 1 else ():
            yield from sensitivities(diagram, [name], outputs)
