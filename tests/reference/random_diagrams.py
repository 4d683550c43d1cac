"""Random diagrams of all block types, represented such that they can be changed and reduced.

Sources jump to, touch and graze the switching values of other blocks. Examples are sawtooth waves that reach
a limit exactly when they jump, square waves equal to a limit, sines whose crest touches a limit, steps at
recorded times, and pulses in phase with ticks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from armblocks.blocks import BLOCKS
from armblocks.diagram import Block, Diagram, DiagramBuilder, Parameter, ParameterKind, PortRef
from armblocks.equations import Shape
from armblocks.errors import ArmblocksError
from armblocks.face.block_examples import example_block

RECORD = 0.0625
"""Sample time of the record, s. A power of 2, so that the times of sources are often exact multiples."""
LIMITS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Switching values of blocks, which sources reach exactly."""
PERIODS = (0.0625, 0.125, 0.25, 0.1, 0.3, (0.125, 0.0625), (0.2, 0.1))
EXCLUDED = (
    # Blocks for files, Python code and ends of runs; the generator builds the structure itself. A manual
    # switch needs a user, and a spectrum is computed after the run.
    "FromFile Trajectory ToFile PythonFunction CalledPythonFunction StopSimulation Assertion Spectrum "
    "ManualSwitch Goto From BusCreator BusSelector BusAssignment Merge Inport Outport Subsystem "
    "EnabledSubsystem TriggeredSubsystem EnabledTriggeredSubsystem ResettableSubsystem "
    "ActionSubsystem If SwitchCase"
)
SLOW = "ArmPlant ForwardDynamics LoadedRne JointPID SampledJointPID"
SWITCHING = (
    "Saturation DeadZone Sign Abs MinMax CompareToConstant CompareToZero IntervalTest IntervalTestDynamic "
    "RelationalOperator Switch Quantizer Rounding Modulo CoulombFriction Relay SaturationDynamic "
    "DeadZoneDynamic WrapToZero MultiportSwitch LookupTable1D HitCrossing LogicalOperator"
)
DIVIDING = "Divide LinearSolve Product"
"""Blocks whose inputs must differ: equations are simplified, so that u / u is 1 even where u is 0."""
HYSTERESIS = "Relay Backlash RateLimiterContinuous Quantizer"
STATES = (
    "Integrator FirstOrderLag ResettableIntegrator IntegratorLimited SecondOrderIntegrator TransferFunction "
    "RateLimiterContinuous RateLimiterDynamic SecondOrderIntegratorLimited UnitDelay ZeroOrderHold "
    "DiscreteIntegrator DiscreteTransferFunction Memory TransportDelay"
)


@dataclass(frozen=True)
class Node:
    """One block: its type, parameters, sources of its inputs (``block/port``) by port, and inner blocks."""

    name: str
    kind: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    inside: tuple[Node, ...] = ()


@dataclass(frozen=True)
class Recipe:
    """A diagram as a list of nodes, and its stop time."""

    nodes: tuple[Node, ...]
    stop: float = 2.0

    @property
    def times(self) -> np.ndarray:
        """The recorded times."""
        return np.arange(round(self.stop / RECORD) + 1) * RECORD

    def diagram(self) -> Diagram:
        """Build the diagram. Raises ``ArmblocksError`` if it is refused."""
        return built(self.nodes, "fuzz")


@dataclass(frozen=True)
class Signal:
    """An output that may be connected. ``steady``: the signal is constant or changes only at ticks."""

    ref: str
    shape: Shape
    steady: bool = False


def block_of(node: Node) -> Block:
    """Return the block that a node describes."""
    kind = BLOCKS[node.kind]
    if node.inside:
        return kind(**dict(node.parameters), diagram=built(node.inside, node.name))
    robots = {
        r.name: getattr(example_block(kind), r.name)
        for r in kind.parameters()
        if r.kind is ParameterKind.ROBOT
    }
    return kind(**(robots | dict(node.parameters)))


def built(nodes: Sequence[Node], name: str) -> Diagram:
    """Build the diagram of some nodes; a source may come after its target in the list."""
    builder = DiagramBuilder(name)
    for node in nodes:
        builder.add(node.name, block_of(node))
    for node in nodes:
        for port, source in node.inputs.items():
            block, _, output = source.rpartition("/")
            builder.connect(PortRef(block, output), PortRef(node.name, port))
    return builder.build()


class RecipeGenerator:
    """Generates one diagram from a seed."""

    def __init__(self, seed: int, size: int = 10) -> None:
        self.random = np.random.default_rng(seed)
        self.size = size
        self.count = 0

    def recipe(self) -> Recipe:
        """Generate a diagram of about ``size`` blocks."""
        nodes = self.level(self.size, depth=0)
        return Recipe(nodes, float(self.random.choice([1.0, 2.0, 3.0])))

    def level(
        self, size: int, depth: int, sources: Sequence[Signal] = (), for_trigger: bool = False
    ) -> tuple[Node, ...]:
        """Generate the nodes of one level. ``for_trigger``: only blocks that a triggered
        subsystem may have."""
        self_nodes: list[Node] = []
        signals = list(sources)
        loops = [] if for_trigger or self.random.random() < 0.4 else self.begin_feedback(self_nodes, signals)
        if not sources:
            for _ in range(int(self.random.integers(1, 4))):
                self.add(self_nodes, signals, *self.source())
        for _ in range(size):
            if depth < 2 and self.random.random() < 0.1 and len(signals) > 1:
                self.subsystem(self_nodes, signals, depth)
            elif not for_trigger and self.random.random() < 0.02:
                self.ball(self_nodes, signals)
            elif self.random.random() < 0.05:
                self.comparison(self_nodes, signals)
            else:
                self.block(self_nodes, signals, for_trigger)
        return self.end_feedback(self_nodes, signals, loops)

    # -- parts ---------------------------------------------------------------------------------------------

    def add(
        self,
        nodes: list[Node],
        signals: list[Signal],
        kind: str,
        parameters: Mapping[str, Any],
        inputs: Mapping[str, Signal] | None = None,
        inside: tuple[Node, ...] = (),
    ) -> bool:
        """Add a block if it accepts these parameters and inputs; its outputs become signals."""
        inputs = inputs or {}
        self.count += 1
        node = Node(
            f"{kind.lower()} {self.count}", kind, parameters, {p: s.ref for p, s in inputs.items()}, inside
        )
        try:
            block = block_of(node)
            input_shapes = {name: signal.shape for name, signal in inputs.items()}
            shapes = {p.name: p.shape for p in block.output_ports() if p.shape is not None}
            shapes |= dict(block.output_shapes(input_shapes))
        except (ArmblocksError, ValueError, KeyError):
            return False
        nodes.append(node)
        steady = block.sampled or all(s.steady for s in inputs.values())
        steady = steady and (bool(inputs) or block.sampled or kind == "Constant")
        steady = steady and not (block.states(input_shapes) or block.delay_lines(input_shapes) or inside)
        ports = block.output_ports()
        signals += [Signal(f"{node.name}/{port.name}", shapes.get(port.name, ()), steady) for port in ports]
        return True

    def source(self) -> tuple[str, dict[str, Any]]:
        """Return a source that jumps to, touches or grazes switching values."""
        r = self.random
        height, low = float(r.choice([0.5, 1.0, 1.0, r.uniform(0.3, 2.5)])), float(r.choice(LIMITS))
        grid = float(RECORD * r.integers(1, 30))
        frequency = float(r.choice([1.0, 2.0, 0.5, 4.0, r.uniform(0.3, 3.0), r.uniform(0.3, 3.0)]))
        choices: list[tuple[str, dict[str, Any]]] = [
            ("SignalGenerator", {"waveform": "sawtooth", "amplitude": height, "frequency": frequency}),
            ("SignalGenerator", {"waveform": "square", "amplitude": height, "frequency": frequency}),
            (
                "Step",
                {"time": float(r.choice([grid, r.uniform(0.1, 1.5)])), "initial": low, "final": -low + 0.5},
            ),
            (
                "Pulse",
                {
                    "start": grid,
                    "width": float(r.choice([0.25, 0.5, r.uniform(0.1, 1.0)])),
                    "amplitude": height,
                },
            ),
            (
                "PulseGenerator",
                {
                    "period": float(r.choice([0.25, 0.5, r.uniform(0.2, 1.0)])),
                    "width": float(r.choice([50.0, 25.0, 37.0])),
                    "amplitude": height,
                },
            ),
            (
                "RepeatingSequence",
                {"times": (0.0, 0.25, 0.5, 0.75), "values": tuple(float(r.choice(LIMITS)) for _ in range(4))},
            ),
            ("SineWave", self.sine(height)),
            ("SineWave", {"amplitude": (1.0, 0.5), "frequency": (3.0, float(r.uniform(1, 6))), "phase": 0.3}),
            (
                "Ramp",
                {
                    "slope": float(r.choice([1.0, -0.5, 2.0])),
                    "start": float(r.choice([0.0, grid, r.uniform(0.1, 1.0)])),
                    "initial": low,
                },
            ),
            ("Clock", {}),
            ("Constant", {"value": float(r.choice([*LIMITS, r.normal()]))}),
            ("Constant", {"value": tuple(float(v) for v in r.normal(size=2))}),
            (
                "RepeatingSequenceStair",
                {"values": tuple(float(r.choice(LIMITS)) for _ in range(3)), "sample_time": self.period()},
            ),
            ("UniformRandomNumber", {"sample_time": self.period(), "seed": int(r.integers(1, 1000))}),
            ("CounterLimited", {"upper": 3, "sample_time": self.period()}),
        ]
        return choices[int(r.integers(len(choices)))]

    def sine(self, amplitude: float) -> dict[str, Any]:
        """Return a sine that may touch a switching value, but not at a tick: rounding changes such events."""
        r = self.random
        frequency = float(r.choice([math.pi, 2 * math.pi, 2.0, r.uniform(0.5, 9.0)]))
        phase = float(r.choice([0.0, math.pi / 2, r.uniform(0, 6)]))
        any_phase = float(r.uniform(0, 6))
        return {
            "amplitude": amplitude,
            "frequency": frequency,
            "phase": any_phase if frequency % math.pi == 0.0 else phase,
            "bias": float(r.choice([0.0, 0.5, -0.5])),
        }

    def period(self) -> Any:
        return PERIODS[int(self.random.integers(len(PERIODS)))]

    def block(self, nodes: list[Node], signals: list[Signal], for_trigger: bool) -> None:
        """Add a random block with existing signals as inputs."""
        r = self.random
        for _ in range(20):
            draw = r.random()
            if draw < 0.12:
                if not for_trigger and self.add(nodes, signals, *self.source()):
                    return
                continue
            pool = list(BLOCKS)
            if draw < 0.45:
                pool = SWITCHING.split()
            elif draw < 0.6:
                pool = STATES.split()
            name = str(r.choice(pool))
            if name in EXCLUDED.split() or (name in SLOW.split() and r.random() < 0.9):
                continue
            kind = BLOCKS[name]
            parameters = self.parameters(name)
            if for_trigger and kind.sampled:
                parameters["sample_time"] = -1.0
            node = Node("trial", name, parameters)
            try:
                block = block_of(node)
            except (ArmblocksError, ValueError):
                continue
            if not block.input_ports():
                continue
            inputs = self.input_signals(block, signals)
            if inputs is None or (
                for_trigger
                and (
                    block.states({p: s.shape for p, s in inputs.items()})
                    or block.delay_lines({p: s.shape for p, s in inputs.items()})
                )
            ):
                continue
            if (
                kind.sampled
                and not for_trigger
                and all(s.steady for s in inputs.values())
                and r.random() < 0.3
            ):
                parameters["sample_time"] = -1.0
            before = len(nodes)
            if self.add(nodes, signals, name, parameters, inputs):
                if parameters.get("sample_time") == -1.0 and not for_trigger and not _accepted(nodes):
                    nodes[before] = replace(nodes[before], parameters={**parameters, "sample_time": 0.1})
                return

    def input_signals(self, block: Block, signals: Sequence[Signal]) -> dict[str, Signal] | None:
        """Return signals whose shapes the block accepts."""
        ports = block.input_ports()
        for attempt in range(6):
            default_shape = () if attempt < 4 else (2,)
            inputs: dict[str, Signal] = {}
            for port in ports:
                shape = port.shape
                fitting = [s for s in signals if s.shape == (default_shape if shape is None else shape)]
                if not fitting:
                    break
                # prefer later signals, so that chains are formed
                index = int(len(fitting) * math.sqrt(self.random.random()))
                inputs[port.name] = fitting[index]
            if len(inputs) < len(ports):
                continue
            different = len({signal.ref for signal in inputs.values()}) == len(ports)
            if type(block).__name__ in DIVIDING.split() and not different:
                continue
            try:
                block.output_shapes({name: signal.shape for name, signal in inputs.items()})
            except ArmblocksError:
                continue
            return inputs
        return None

    def parameters(self, name: str) -> dict[str, Any]:
        """Return the parameters of the worked example, or the defaults, with random changes."""
        kind = BLOCKS[name]
        values = (
            {k: v for k, v in kind.example.parameters.items() if k != "robot"}
            if self.random.random() < 0.5
            else {}
        )
        for rule in kind.parameters():
            if rule.name == "sample_time":
                values[rule.name] = self.period()
            elif self.random.random() < 0.4:
                value = self.altered(rule)
                if value is not None:
                    values[rule.name] = value
        try:
            kind(**values) if not _needs_robot(name) else None
        except (ArmblocksError, ValueError):
            values = {k: v for k, v in values.items() if k == "sample_time"}
        return values

    def altered(self, rule: Parameter) -> Any:
        """Return another value of one parameter, or None if it must not change."""
        r = self.random
        if rule.kind is ParameterKind.CHOICE:
            return str(r.choice(list(rule.choices)))
        if rule.kind is ParameterKind.BOOLEAN:
            return bool(r.integers(2)) if rule.name != "zero_crossing" else None
        if rule.kind in (ParameterKind.NUMBER, ParameterKind.ARRAY) and np.ndim(rule.default) == 0:
            if rule.default is None or (
                rule.name in ("order", "inputs") or not isinstance(rule.default, int | float)
            ):
                return None
            value = float(r.choice([*LIMITS, 2.0, r.uniform(-2, 2)]))
            if rule.unit == "s":
                value = float(r.choice([0.1, 0.25, 0.5, r.uniform(0.1, 1.0)]))
            lower = rule.minimum if rule.above is None else max(rule.minimum, rule.above + 0.1)
            return float(np.clip(value, lower, rule.maximum))
        return None

    def subsystem(self, nodes: list[Node], signals: list[Signal], depth: int) -> None:
        """Add a subsystem of random type with a few blocks."""
        r = self.random
        scalars = [s for s in signals if s.shape == ()]
        if len(scalars) < 2:
            return
        kinds = (
            "Subsystem",
            "EnabledSubsystem",
            "TriggeredSubsystem",
            "ResettableSubsystem",
            "EnabledTriggeredSubsystem",
            "branches",
        )
        kind = str(r.choice(kinds))
        subsystem_inputs = [scalars[int(r.integers(len(scalars)))] for _ in range(int(r.integers(1, 3)))]
        for_trigger = "Triggered" in kind
        if kind == "branches":
            self.branches(nodes, signals, scalars, subsystem_inputs, depth)
            return
        inside = self.inside(subsystem_inputs, depth, for_trigger)
        if inside is None:
            return
        parameters: dict[str, Any] = {}
        ports: dict[str, Signal] = {f"in{k}": s for k, s in enumerate(subsystem_inputs)}
        control = self.control(nodes, signals, scalars)
        if kind == "EnabledSubsystem":
            parameters["states_when_enabling"] = str(r.choice(["held", "reset"]))
        elif kind != "Subsystem":
            parameters["edge"] = str(r.choice(["rising", "falling", "either"]))
        names = {
            "EnabledSubsystem": ["enable"],
            "TriggeredSubsystem": ["trigger"],
            "ResettableSubsystem": ["reset"],
            "EnabledTriggeredSubsystem": ["enable", "trigger"],
        }
        for port in names.get(kind, []):
            ports[port] = control
            control = self.control(nodes, signals, scalars)
        if self.add(nodes, signals, kind, parameters, ports, inside):
            self.add_event_block(nodes, signals)

    def control(self, nodes: list[Node], signals: list[Signal], scalars: Sequence[Signal]) -> Signal:
        """Return a scalar signal, or the difference of a late signal and it: both may jump together."""
        r = self.random
        chosen = scalars[int(r.integers(len(scalars)))]
        if r.random() < 0.5:
            late = scalars[-1 - int(r.integers(min(3, len(scalars))))]
            if late != chosen and self.add(
                nodes, signals, "Sum", {"signs": "+-"}, {"u1": late, "u2": chosen}
            ):
                return signals[-1]
        return chosen

    def add_event_block(self, nodes: list[Node], signals: list[Signal]) -> None:
        """Connect a block with an event to the latest signal.

        The block must not react to values of unfinished event iterations.
        """
        r, latest_signal = self.random, signals[-1]
        if latest_signal.shape == () and r.random() < 0.7:
            kind, limit = (("HitCrossing", "offset"), ("Relay", "on_point"))[int(r.integers(2))]
            self.add(nodes, signals, kind, {limit: float(r.uniform(-1.0, 1.5))}, {"u": latest_signal})

    def inside(
        self, subsystem_inputs: Sequence[Signal], depth: int, for_trigger: bool
    ) -> tuple[Node, ...] | None:
        """Return In blocks, some other blocks, and one or two Out blocks."""
        entries = [Node(f"in{k}", "Inport") for k in range(len(subsystem_inputs))]
        sources = [Signal(f"in{k}/y", s.shape, False) for k, s in enumerate(subsystem_inputs)]
        inner = self.level(int(self.random.integers(1, 4)), depth + 1, sources, for_trigger)
        if not inner:
            return None
        ends: list[Node] = []
        scalars = [s for s in self.latest if s.shape == () and not s.ref.startswith("in")]
        for number in range(int(self.random.integers(1, 3))):
            if scalars:
                chosen = scalars[int(self.random.integers(len(scalars)))]
                when_off = str(self.random.choice(["held", "reset"]))
                ends.append(
                    Node(
                        f"out{number}",
                        "Outport",
                        {"when_off": when_off, "initial": float(self.random.choice(LIMITS))},
                        {"u": chosen.ref},
                    )
                )
        return (*entries, *inner, *ends) if ends else None

    def branches(
        self,
        nodes: list[Node],
        signals: list[Signal],
        scalars: Sequence[Signal],
        subsystem_inputs: Sequence[Signal],
        depth: int,
    ) -> None:
        """Add an If block, two action subsystems and a Merge."""
        control = scalars[int(self.random.integers(len(scalars)))]
        limit = float(self.random.choice(LIMITS))
        self.add(nodes, signals, "If", {"expressions": f"u > {limit}"}, {"u": control})
        choice = nodes[-1].name
        merged: dict[str, Signal] = {}
        for number, port in enumerate(("if1", "else"), 1):
            inside = self.inside(subsystem_inputs, depth, False)
            if inside is None:
                return
            inside = tuple(n for n in inside if n.kind != "Outport" or n.name == "out0")
            ports = {f"in{k}": s for k, s in enumerate(subsystem_inputs)} | {
                "action": Signal(f"{choice}/{port}", ())
            }
            states = str(self.random.choice(["held", "reset"]))
            if not self.add(
                nodes, signals, "ActionSubsystem", {"states_when_resuming": states}, ports, inside
            ):
                return
            merged[f"u{number}"] = signals.pop()
        if self.add(nodes, signals, "Merge", {"initial": limit}, merged):
            self.add_event_block(nodes, signals)

    def ball(self, nodes: list[Node], signals: list[Signal]) -> None:
        """Add a ball that falls from a height, at once or later, and bounces until it rests."""
        r = self.random
        self.add(
            nodes,
            signals,
            "Step",
            {"time": float(r.choice([0.0, 0.5, r.uniform(0, 1)])), "initial": 0.0, "final": -9.81},
        )
        gravity = signals[-1]
        self.add(nodes, signals, "Bias", {"bias": 0.0}, {"u": gravity})
        parameters = {"lower": 0.0, "initial": float(r.choice([0.0, 0.3, 1.0])), "reinitialize": True}
        self.count += 1
        name = f"ball {self.count}"
        back = Node(
            f"bounce {self.count}", "Gain", {"gain": -float(r.uniform(0.1, 0.95))}, {"u": f"{name}/dx"}
        )
        ball = Node(
            name, "SecondOrderIntegratorLimited", parameters, {"u": gravity.ref, "dx0": f"{back.name}/y"}
        )
        nodes += [back, ball]
        signals += [Signal(f"{name}/x", ()), Signal(f"{name}/dx", ())]

    def comparison(self, nodes: list[Node], signals: list[Signal]) -> None:
        """Add blocks with events for the difference of two switching blocks in series or in parallel.

        At a jump the two blocks reach their values in different iterations. The difference of their outputs
        between these iterations must not cause an event.
        """
        r = self.random
        scalars = [s for s in signals if s.shape == ()]
        if not scalars:
            return
        block_input = scalars[int(r.integers(len(scalars)))]
        operands: list[Signal] = []
        for _ in range(2):
            kind = str(r.choice(HYSTERESIS.split() if r.random() < 0.6 else SWITCHING.split()))
            if len(BLOCKS[kind]().input_ports()) == 1 and self.add(
                nodes, signals, kind, self.parameters(kind), {"u": block_input}
            ):
                operands.append(signals[-1])
                block_input = signals[-1] if r.random() < 0.5 else block_input
        inputs = dict(zip(("u1", "u2"), [*operands, block_input, block_input]))
        if self.add(nodes, signals, "Sum", {"signs": "+-"}, inputs):
            difference = signals[-1]
            for kind, limit in (("HitCrossing", "offset"), ("Relay", "on_point")):
                value = float(r.choice([0.3, 0.5, 0.7]))
                self.add(nodes, signals, kind, {limit: value}, {"u": difference})

    def begin_feedback(self, nodes: list[Node], signals: list[Signal]) -> list[str]:
        """Add a block for a feedback loop, whose input is connected at the end."""
        kind = str(self.random.choice(["FirstOrderLag", "Integrator", "UnitDelay", "Gain"]))
        parameters: dict[str, Any] = {"UnitDelay": {"sample_time": self.period()}, "Gain": {"gain": 0.3}}.get(
            kind, {}
        )
        self.count += 1
        name = f"back {self.count}"
        nodes.append(Node(name, kind, parameters))
        signals.append(Signal(f"{name}/y", (), kind == "UnitDelay"))
        return [name]

    def end_feedback(
        self, nodes: list[Node], signals: list[Signal], loops: Sequence[str]
    ) -> tuple[Node, ...]:
        """Connect the inputs of the feedback blocks; an integrator becomes a leaky one."""
        for name in loops:
            scalars = [s for s in signals if s.shape == ()]
            last = scalars[-1 - int(self.random.integers(min(3, len(scalars))))]
            node = next(n for n in nodes if n.name == name)
            if node.kind == "Integrator":
                self.add(nodes, signals, "Sum", {"signs": "+-"}, {"u1": last, "u2": Signal(f"{name}/y", ())})
                last = signals[-1]
            nodes[nodes.index(node)] = replace(node, inputs={"u": last.ref})
        self.latest = signals
        return tuple(nodes)


def _needs_robot(name: str) -> bool:
    return any(rule.kind is ParameterKind.ROBOT for rule in BLOCKS[name].parameters())


def _accepted(nodes: Sequence[Node]) -> bool:
    try:
        Recipe(tuple(nodes)).diagram()
    except ArmblocksError:
        return False
    return True


def random_recipe(seed: int, size: int = 10) -> Recipe:
    """Generate the diagram of a seed; a refused diagram is replaced by that of the next number."""
    for number in range(100):
        try:
            recipe = RecipeGenerator(1000 * seed + number, size).recipe()
            recipe.diagram()
        except ArmblocksError:
            continue
        return recipe
    raise AssertionError(f"no diagram from seed {seed}")


# -- smaller diagrams --------------------------------------------------------------------------------------


def reductions(recipe: Recipe) -> Iterator[Recipe]:
    """Yield recipes reduced by one step: fewer or simpler nodes, fewer parameters, or half the stop time."""
    for nodes in _smaller(recipe.nodes):
        yield replace(recipe, nodes=nodes)
    if recipe.stop > 0.5:
        yield replace(recipe, stop=round(recipe.stop / 2 / RECORD) * RECORD)


def _smaller(nodes: tuple[Node, ...]) -> Iterator[tuple[Node, ...]]:
    used = {source.rpartition("/")[0] for node in nodes for source in node.inputs.values()}
    for node in reversed(nodes):
        others = tuple(entry for entry in nodes if entry.name != node.name)
        if node.kind == "Inport":
            continue
        if node.name not in used and (node.kind != "Outport" or sum(n.kind == "Outport" for n in nodes) > 1):
            yield others
            continue
        if node.kind == "Outport":
            continue
        for source in dict.fromkeys(node.inputs.values()):
            yield _with_source_replaced(others, node.name, source)
        if node.kind != "Constant":
            constant = Node(node.name, "Constant", {"value": 1.0})
            yield tuple(
                constant if entry is node else replace(entry, inputs=_to_constant(entry.inputs, node.name))
                for entry in nodes
            )
    for k, node in enumerate(nodes):
        for name in node.parameters:
            remaining = {key: value for key, value in node.parameters.items() if key != name}
            yield (*nodes[:k], replace(node, parameters=remaining), *nodes[k + 1 :])
        for inside in _smaller(node.inside):
            yield (*nodes[:k], replace(node, inside=inside), *nodes[k + 1 :])


def _with_source_replaced(nodes: tuple[Node, ...], name: str, source: str) -> tuple[Node, ...]:
    def other(ref: str) -> str:
        return source if ref.rpartition("/")[0] == name else ref

    return tuple(replace(n, inputs={port: other(ref) for port, ref in n.inputs.items()}) for n in nodes)


def _to_constant(inputs: Mapping[str, str], name: str) -> dict[str, str]:
    return {p: f"{name}/y" if s.rpartition("/")[0] == name else s for p, s in inputs.items()}
