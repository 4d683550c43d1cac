"""Simulations compared with Drake, bdsim and PathSim, and run times of large diagrams.

Computed torque: the shipped `puma560_computed_torque`. bdsim uses blocks of the Robotics Toolbox with
inverse dynamics in C. Drake uses InverseDynamicsController, TrajectorySource and MultibodyPlant, all
native. Van der Pol: the shipped `van_der_pol_pid`, 100 s. In Drake the plant is a SymbolicVectorSystem.
Both models: adaptive methods of order 5 at rtol 1e-6 (Drake: accuracy 1e-6), time without compilation.
armblocks records 1001 and 2001 samples of all signals. Five blocks: step, sum, gain and two integrators, 10
s in steps of 1 ms. The method is RK4, with two exceptions: SciPy's 5(4) method with a maximum step of 1 ms
in bdsim, which has no fixed step, and runge_kutta3 with fixed steps in Drake.
Multirate: the shipped `puma560_multirate`, 10 s, 100 000 ticks. bdsim would need minutes for it. It
therefore simulates the first 0.1 s (1000 ticks), and its time is multiplied by 100. The states at 0.1 s are
compared. At common ticks of both clocks, the current loop of bdsim reads the new torque one tick later.
"""

# Drake's type stubs do not match its functions.
# pyright: basic, reportMissingImports=false, reportAttributeAccessIssue=false, reportArgumentType=false
# pyright: reportCallIssue=false, reportOptionalMemberAccess=false
from __future__ import annotations

import json
import logging
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from compare import five_blocks
from measure import Timing, in_turn
from urdf import to_urdf

import armblocks as ab

HERE = Path(__file__).parent
QF = np.array([0.5, 0.9, -0.8, 0.6, -0.4, 1.0])


@dataclass(frozen=True)
class Run:
    """One run of one program: wall time without compilation in s, number of steps, final values."""

    seconds: float
    steps: int
    final: Sequence[float]


@dataclass(frozen=True)
class Row:
    name: str
    peer: str
    theirs: Timing
    ours: Timing
    target: float
    difference: float
    """Largest difference of the final values."""

    @property
    def ratio(self) -> float:
        return self.ours.times_faster_than(self.theirs)


class PythonPeers:
    """bdsim and PathSim in a separate process; see `python_peers.py`."""

    def __init__(self) -> None:
        python = os.environ.get("ARMBLOCKS_PEERS", sys.executable)
        self._process = subprocess.Popen(
            [python, str(HERE / "python_peers.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def run(self, tool: str, model: str) -> Run:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(f"{tool} {model}\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit("bdsim and PathSim are not installed: see benchmarks/python_peers.py")
        return Run(**json.loads(line))

    def close(self) -> None:
        self._process.terminate()


def drake_computed_torque() -> Run:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.polynomial import Polynomial
    from pydrake.systems.controllers import InverseDynamicsController
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
    from pydrake.trajectories import PiecewisePolynomial

    robot = ab.load_robot("puma560").robot

    def plant() -> MultibodyPlant:
        result = MultibodyPlant(0.0)
        Parser(result).AddModelsFromString(to_urdf(robot), "urdf")
        result.WeldFrames(result.world_frame(), result.GetFrameByName("base"))
        for number, link in enumerate(robot.links, start=1):
            actuator = result.AddJointActuator(f"a{number}", result.GetJointByName(f"j{number}"))
            actuator.set_default_rotor_inertia(link.motor.inertia)
            actuator.set_default_gear_ratio(link.motor.gear_ratio)
        result.Finalize()
        return result

    T = 10.0
    rows = [[Polynomial([0, 0, 0, 10 * d / T**3, -15 * d / T**4, 6 * d / T**5])] for d in QF]
    path = PiecewisePolynomial([np.array(rows)], [0.0, T])
    builder, model = DiagramBuilder(), plant()
    arm = builder.AddSystem(plant())
    state = builder.AddSystem(TrajectorySource(path, 1))
    acceleration = builder.AddSystem(TrajectorySource(path.derivative(2), 0))
    gains = np.full(6, 100.0), np.zeros(6), np.full(6, 20.0)
    control = builder.AddSystem(InverseDynamicsController(model, *gains, True))
    builder.Connect(state.get_output_port(), control.get_input_port_desired_state())
    builder.Connect(acceleration.get_output_port(), control.get_input_port_desired_acceleration())
    builder.Connect(arm.get_state_output_port(), control.get_input_port_estimated_state())
    builder.Connect(control.GetOutputPort("generalized_force"), arm.get_actuation_input_port())
    LogVectorOutput(arm.get_state_output_port(), builder, 0.01)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    start = np.concatenate([np.full(6, 0.1), np.zeros(6)])
    arm_context = arm.GetMyMutableContextFromRoot(context)
    arm.SetPositionsAndVelocities(arm_context, start)
    return _drake_run(diagram, context, T, "runge_kutta5", 1e-6, 0.1)


def drake_van_der_pol() -> Run:
    from pydrake.symbolic import MakeVectorVariable
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import (
        Adder,
        Demultiplexer,
        Gain,
        Integrator,
        LogVectorOutput,
        Sine,
        SymbolicVectorSystem,
    )

    builder = DiagramBuilder()
    wave, error = builder.AddSystem(Sine(1.0, 2 * np.pi * 0.1, 0.0, 1)), builder.AddSystem(Adder(2, 1))
    minus, kp, kd = (builder.AddSystem(Gain(gain, 1)) for gain in (-1.0, 2.0, -0.5))
    integral, ki = builder.AddSystem(Integrator(1)), builder.AddSystem(Gain(0.5, 1))
    u = builder.AddSystem(Adder(3, 1))
    x, v = MakeVectorVariable(2, "x"), MakeVectorVariable(1, "u")
    rates = [x[1], (1 - x[0] * x[0]) * x[1] - x[0] + v[0]]
    plant = builder.AddSystem(SymbolicVectorSystem(state=x, input=v, dynamics=rates, output=[x[0], x[1]]))
    split = builder.AddSystem(Demultiplexer(2, 1))

    def connect(source: Any, target: Any, entry: int = 0, port: int = 0) -> None:
        builder.Connect(source.get_output_port(port), target.get_input_port(entry))

    connect(wave, error, 0)
    connect(plant, split)
    connect(split, minus)
    connect(minus, error, 1)
    connect(error, kp)
    connect(error, integral)
    connect(integral, ki)
    connect(split, kd, 0, 1)
    connect(kp, u, 0)
    connect(ki, u, 1)
    connect(kd, u, 2)
    connect(u, plant)
    LogVectorOutput(split.get_output_port(0), builder, 0.05)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.GetMyMutableContextFromRoot(context).SetContinuousState([1.0, 0.0])
    run = _drake_run(diagram, context, 100.0, "runge_kutta5", 1e-6, 1.0)
    return Run(run.seconds, run.steps, plant_states(plant, context))


def plant_states(plant: Any, context: Any) -> list[float]:
    plant_context = plant.GetMyContextFromRoot(context)
    return plant_context.get_continuous_state_vector().CopyToVector().tolist()


def drake_five_blocks() -> Run:
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import Adder, ConstantVectorSource, Gain, Integrator

    builder = DiagramBuilder()
    step, total = builder.AddSystem(ConstantVectorSource([1.0])), builder.AddSystem(Adder(3, 1))
    gain, less, speed_less = (builder.AddSystem(Gain(k, 1)) for k in (4.0, -1.0, -1.0))
    speed, place = builder.AddSystem(Integrator(1)), builder.AddSystem(Integrator(1))
    builder.Connect(step.get_output_port(), total.get_input_port(0))
    builder.Connect(place.get_output_port(), less.get_input_port())
    builder.Connect(speed.get_output_port(), speed_less.get_input_port())
    builder.Connect(less.get_output_port(), total.get_input_port(1))
    builder.Connect(speed_less.get_output_port(), total.get_input_port(2))
    builder.Connect(total.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), speed.get_input_port())
    builder.Connect(speed.get_output_port(), place.get_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    run = _drake_run(diagram, context, 10.0, "runge_kutta3", None, 1e-3)
    return Run(run.seconds, run.steps, [*plant_states(place, context), *plant_states(speed, context)])


def _drake_run(
    diagram: Any, context: Any, stop: float, method: str, accuracy: float | None, max_step: float
) -> Run:
    from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, method, max_step)
    integrator = simulator.get_mutable_integrator()
    if accuracy is None:
        integrator.set_fixed_step_mode(True)
    else:
        integrator.set_target_accuracy(accuracy)
    simulator.Initialize()
    start_time = time.perf_counter()
    simulator.AdvanceTo(stop)
    seconds = time.perf_counter() - start_time
    final = context.get_continuous_state_vector().CopyToVector().tolist()
    return Run(seconds, integrator.get_num_steps_taken(), final)


FIXED = {"stop_time": 10.0, "step": 1e-3, "solver": "rk4", "sample_time": 0.01}


@dataclass(frozen=True)
class Peer:
    """The same model in another program.

    ``final``: indices of the compared final values; ``factor``: multiplies the run time.
    """

    name: str
    run: Callable[[], Run]
    target: float
    final: Any
    factor: float = 1.0


@dataclass(frozen=True)
class Case:
    """A model with its run in armblocks, the compared signals and the other programs.

    ``compared`` is the run whose final values are compared, unless this is the timed run.
    """

    name: str
    ours: Callable[[], ab.SimulationResult]
    signals: Sequence[str]
    peers: Sequence[Peer]
    compared: Callable[[], ab.SimulationResult] | None = None


def cases(peers: PythonPeers) -> dict[str, list[Case]]:
    """Return the models of each group."""
    torque, oscillator = ab.load_diagram("puma560_computed_torque"), ab.load_diagram("van_der_pol_pid")
    multirate, five = ab.load_diagram("puma560_multirate"), five_blocks()

    def of(tool: str, model: str) -> Callable[[], Run]:
        return lambda: peers.run(tool, model)

    return {
        "simulations": [
            Case(
                "computed torque Puma 560, 10 s",
                lambda: ab.simulate(torque),
                ("arm/q",),
                [
                    Peer("Drake, native systems", drake_computed_torque, 40.0, slice(0, 6)),
                    Peer("bdsim", of("bdsim", "computed_torque"), 400.0, slice(0, 6)),
                ],
            ),
            Case(
                "van der Pol and PID, 100 s",
                lambda: ab.simulate(oscillator),
                ("x1",),
                [
                    Peer("Drake, native systems", drake_van_der_pol, 80.0, slice(0, 1)),
                    Peer("bdsim", of("bdsim", "van_der_pol"), 1500.0, slice(2, 3)),
                    Peer("PathSim", of("pathsim", "van_der_pol"), 1500.0, slice(0, 1)),
                ],
            ),
            Case(
                "five blocks, 10 s in 10 000 steps",
                lambda: ab.simulate(five, **FIXED),
                ("place", "speed"),
                [
                    Peer("PathSim", of("pathsim", "five_blocks"), 0.0, [0, 1]),
                    Peer("bdsim", of("bdsim", "five_blocks"), 0.0, [1, 0]),
                    Peer("Drake", drake_five_blocks, 0.0, [0, 1]),
                ],
            ),
        ],
        "multirate": [
            Case(
                "multirate Puma 560, 1 and 10 kHz, 10 s",
                lambda: ab.simulate(multirate),
                ("arm/q", "arm/qd"),
                [Peer("bdsim, 0.1 s times 100", of("bdsim", "multirate"), 200.0, slice(0, 12), factor=100.0)],
                compared=lambda: ab.simulate(multirate, stop_time=0.1),
            )
        ],
    }


def rows(group: str, repeats: int) -> list[Row]:
    """Compare all models of a group; the programs run in alternation."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    peers = PythonPeers()
    rows_of_group: list[Row] = []
    for case in cases(peers)[group]:
        case.ours()
        result = (case.compared or case.ours)()
        end = np.concatenate([np.ravel(result[name][-1]) for name in case.signals])
        times: list[list[float]] = [[] for _ in case.peers]
        mine: list[float] = []
        worst = [0.0] * len(case.peers)
        for _ in range(repeats):
            for k, peer in enumerate(case.peers):
                run = peer.run()
                times[k].append(run.seconds * peer.factor)
                worst[k] = max(worst[k], float(np.abs(np.asarray(run.final)[peer.final] - end).max()))
            mine += in_turn([case.ours], 1)[0].turns
        rows_of_group += [
            Row(case.name, peer.name, Timing(tuple(times[k])), Timing(tuple(mine)), peer.target, worst[k])
            for k, peer in enumerate(case.peers)
        ]
    peers.close()
    return rows_of_group


GROWTH = """
import json, sys, time
import armblocks as ab
from armblocks.blocks import Gain, Integrator, Saturation, Scope, SineWave, TransferFunction, UnitDelay
count, kinds = int(sys.argv[1]), sys.argv[2]
make = {
    "gains": [lambda: Gain(gain=0.99)],
    "mixed": [
        lambda: Gain(gain=0.99),
        lambda: TransferFunction(numerator=[1.0], denominator=[1.0, 1.0]),
        lambda: UnitDelay(sample_time=0.01),
        lambda: Saturation(lower=-0.9, upper=0.9),
    ],
}[kinds]
times = [time.perf_counter()]
builder = ab.DiagramBuilder("chain")
last = builder.add("source", SineWave())
for k in range(count):
    last = builder.add(f"b{k}", make[k % len(make)](), last)
builder.add("scope", Scope(), last)
model = ab.CompiledDiagram(builder.build())
times.append(time.perf_counter())
model.system
times.append(time.perf_counter())
result = model.simulate()
times.append(time.perf_counter())
spent = [b - a for a, b in zip(times, times[1:])]
print(json.dumps([spent[0], spent[1], spent[2] - result.run.wall_time, result.run.wall_time]))
"""


def growth(repeats: int, counts: Sequence[int] = (10, 100, 1000, 10_000)) -> list[list[str]]:
    """Table of times to build, trace, compile and run chains of blocks, s; each in a new process."""
    table: list[list[str]] = []
    for kinds in ("gains", "mixed"):
        for count in counts:
            turns: list[list[float]] = []
            for _ in range(repeats if count <= 1000 else max(1, repeats // 3)):
                completed = subprocess.run(
                    [sys.executable, "-c", GROWTH, str(count), kinds],
                    env={**os.environ, "ARMBLOCKS_CACHE_DIR": ""},
                    capture_output=True,
                    text=True,
                    check=True,
                )
                turns.append(json.loads(completed.stdout))
            best = min(turns, key=sum)
            typical = statistics.median(map(sum, turns))
            table.append(
                [
                    f"{count:,} blocks, {kinds}",
                    *(f"{part:.3f}" for part in best),
                    f"{sum(best):.2f}",
                    f"{typical:.2f}",
                ]
            )
    return table
