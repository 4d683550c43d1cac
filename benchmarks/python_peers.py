"""Run bdsim and PathSim in a separate process and environment, on requests from standard input.

    python -m venv peers && peers/bin/pip install bdsim==1.4.0 pathsim==0.27.1 roboticstoolbox-python==1.5.0
    ARMBLOCKS_PEERS=peers/bin/python python benchmarks/run.py

Each line `TOOL MODEL` of the input gives one JSON line: wall time of the run in s, number of steps, final
states. The program builds the model again for each line, outside the measured time. Graphics and progress
output are off.

- `computed_torque`: Puma 560 without friction, quintic reference in 10 s, computed torque (KP 100, KD 20),
  initial error 0.1 rad; Runge-Kutta 5(4), rtol 1e-6, atol 1e-8.
- `van_der_pol`: the van der Pol oscillator under PI control with velocity feedback, 100 s, rtol 1e-6, atol
  1e-9, Runge-Kutta 5(4).
- `five_blocks`: step, sum, gain, second-order plant of two integrators, 10 s; fixed steps of 1 ms, RK4.
- `multirate`: the first 0.1 s of the shipped `puma560_multirate`: computed torque at 1 kHz (KP 900, KD 60)
  around PI control of the currents at 10 kHz, windings of six motors, the arm with viscous friction;
  Runge-Kutta 5(4), rtol 1e-6, atol 1e-9. At a tick, a sampled block of bdsim outputs its input of the
  previous tick. The proportional gain is therefore reduced by the contribution of one tick to the integral.
"""

# bdsim and PathSim have no type annotations.
# pyright: basic, reportMissingImports=false
from __future__ import annotations

import importlib.machinery
import importlib.util
import json
import sys
import time
from collections.abc import Callable, Sequence
from importlib.abc import MetaPathFinder
from typing import Any

import numpy as np

QF = np.array([0.5, 0.9, -0.8, 0.6, -0.4, 1.0])
KP, KD, T = 100.0, 20.0, 10.0


class _PatchedBdsimFinder(MetaPathFinder):
    """Import finder that corrects one line of bdsim 1.4.0, which fails with roboticstoolbox 1.5.0."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: Any = None) -> Any:
        if name != "bdsim.run_sim":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        if spec is not None and spec.origin is not None:
            spec.loader = _PatchedSourceLoader(name, spec.origin)
        return spec


class _PatchedSourceLoader(importlib.machinery.SourceFileLoader):
    def get_data(self, path: str) -> bytes:
        if not path.endswith(".py"):
            raise OSError("no bytecode: the source is patched")
        return super().get_data(path).replace(b'dict["type"].get', b'dict.get("type", {}).get')


def quintic(t: float, T: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    u = min(max(t / T, 0.0), 1.0)
    return (
        QF * (u**3 * (10 + u * (-15 + 6 * u))),
        QF * (u * u * (30 + u * (-60 + 30 * u))) / T,
        QF * (u * (60 + u * (-180 + 120 * u))) / T**2,
    )


def bdsim_run(model: str) -> dict[str, Any]:
    import bdsim

    sim = bdsim.BDSim(graphics=False, progress=False, quiet=True, sysargs=False)
    bd = sim.blockdiagram()
    settings = BDSIM[model](bd)
    bd.compile()
    start_time = time.perf_counter()
    out = sim.run(bd, **settings)
    seconds = time.perf_counter() - start_time
    return {"seconds": seconds, "steps": len(out.t), "final": np.asarray(out.x)[-1].tolist()}


def _bdsim_computed_torque(bd: Any) -> dict[str, Any]:
    import roboticstoolbox as rtb

    robot = rtb.models.DH.Puma560().nofriction(coulomb=True, viscous=True)
    path, arm, inverse = bd.JTRAJ(np.zeros(6), QF), bd.FDYN(robot, q0=np.full(6, 0.1)), bd.IDYN(robot)
    e, ed, kp, kd, total = bd.SUM("+-"), bd.SUM("+-"), bd.GAIN(KP), bd.GAIN(KD), bd.SUM("+++")
    bd.connect(path[0], e[0])
    bd.connect(arm[0], e[1])
    bd.connect(path[1], ed[0])
    bd.connect(arm[1], ed[1])
    bd.connect(e, kp)
    bd.connect(ed, kd)
    bd.connect(path[2], total[0])
    bd.connect(kp, total[1])
    bd.connect(kd, total[2])
    bd.connect(arm[0], inverse[0])
    bd.connect(arm[1], inverse[1])
    bd.connect(total, inverse[2])
    bd.connect(inverse, arm)
    bd.connect(arm[2], bd.NULL(nin=1))
    return {"T": T, "solver_args": {"rtol": 1e-6, "atol": 1e-8}}


def _bdsim_van_der_pol(bd: Any) -> dict[str, Any]:
    wave, e, kp = bd.WAVEFORM(wave="sine", freq=0.1), bd.SUM("+-"), bd.GAIN(2.0)
    integral, ki, kd, u = bd.INTEGRATOR(x0=0.0), bd.GAIN(0.5), bd.GAIN(-0.5), bd.SUM("+++")
    f = bd.FUNCTION(lambda x1, x2, u: (1 - x1 * x1) * x2 - x1 + u, nin=3, nout=1)
    x2, x1 = bd.INTEGRATOR(x0=0.0), bd.INTEGRATOR(x0=1.0)
    bd.connect(wave, e[0])
    bd.connect(x1, e[1], f[0])
    bd.connect(e, kp, integral)
    bd.connect(integral, ki)
    bd.connect(x2, kd, f[1], x1)
    bd.connect(kp, u[0])
    bd.connect(ki, u[1])
    bd.connect(kd, u[2])
    bd.connect(u, f[2])
    bd.connect(f, x2)
    return {"T": 100, "solver_args": {"rtol": 1e-6, "atol": 1e-9}}


def _bdsim_five_blocks(bd: Any) -> dict[str, Any]:
    step, e, gain = bd.STEP(T=0.0), bd.SUM("+--"), bd.GAIN(4.0)
    speed, place = bd.INTEGRATOR(x0=0.0), bd.INTEGRATOR(x0=0.0)
    bd.connect(step, e[0])
    bd.connect(e, gain)
    bd.connect(gain, speed)
    bd.connect(speed, place, e[2])
    bd.connect(place, e[1])
    # bdsim has only SciPy's adaptive methods; loose tolerances and a maximum step of 1 ms give steps of 1 ms.
    return {"T": 10.0, "max_step": 1e-3, "solver_args": {"rtol": 1.0, "atol": 1.0, "first_step": 1e-3}}


def _bdsim_multirate(bd: Any) -> dict[str, Any]:
    import roboticstoolbox as rtb

    robot = rtb.models.DH.Puma560().nofriction(coulomb=True, viscous=False)
    R = np.array([2.1, 2.1, 2.1, 6.7, 6.7, 6.7])
    L, k = R / 1000, np.array([0.19, 0.22, 0.2, 0.075, 0.066, 0.066])
    G = np.array([link.G for link in robot.links])
    tick, integral_gain, gain, zero = 1e-4, 3000 * R, 3000 * L, np.zeros(6)
    rest = robot.rne(zero, zero, zero)
    position, current = bd.clock(1e-3), bd.clock(tick)
    now, path = bd.TIME(), bd.FUNCTION(lambda t: quintic(t, 4.0), nin=1, nout=3)
    arm, inverse = bd.FDYN(robot, q0=zero), bd.IDYN(robot)
    e, ed, kp, kd, total = bd.SUM("+-"), bd.SUM("+-"), bd.GAIN(900.0), bd.GAIN(60.0), bd.SUM("+++")
    torque, reference = bd.ZOH(position, x0=rest), bd.FUNCTION(lambda tau: tau / (k * G), nin=1, nout=1)
    missing, held = bd.SUM("+-"), bd.ZOH(current, x0=zero)
    scaled = bd.FUNCTION(lambda u: integral_gain * u, nin=1, nout=1)
    integral = bd.INTEGRATOR_S(current, x0=R * rest / (k * G))
    proportional = bd.FUNCTION(lambda u: (gain - tick * integral_gain) * u, nin=1, nout=1)
    voltage, limited = bd.SUM("++"), bd.CLIP(-40.0, 40.0)
    rate = bd.FUNCTION(lambda v, i, w: (v - R * i - k * G * w) / L, nin=3, nout=1)
    winding, drive = bd.INTEGRATOR(x0=rest / (k * G)), bd.FUNCTION(lambda i: G * k * i, nin=1, nout=1)
    bd.connect(now, path)
    bd.connect(path[0], e[0])
    bd.connect(arm[0], e[1], inverse[0])
    bd.connect(path[1], ed[0])
    bd.connect(arm[1], ed[1], inverse[1], rate[2])
    bd.connect(e, kp)
    bd.connect(ed, kd)
    bd.connect(path[2], total[0])
    bd.connect(kp, total[1])
    bd.connect(kd, total[2])
    bd.connect(total, inverse[2])
    bd.connect(inverse, torque)
    bd.connect(torque, reference)
    bd.connect(reference, missing[0])
    bd.connect(winding, missing[1], rate[1], drive)
    bd.connect(missing, held, scaled)
    bd.connect(scaled, integral)
    bd.connect(held, proportional)
    bd.connect(proportional, voltage[0])
    bd.connect(integral, voltage[1])
    bd.connect(voltage, limited)
    bd.connect(limited, rate[0])
    bd.connect(rate, winding)
    bd.connect(drive, arm)
    bd.connect(arm[2], bd.NULL(nin=1))
    return {"T": 0.1, "solver_args": {"rtol": 1e-6, "atol": 1e-9}}


BDSIM: dict[str, Callable[[Any], dict[str, Any]]] = {
    "computed_torque": _bdsim_computed_torque,
    "van_der_pol": _bdsim_van_der_pol,
    "five_blocks": _bdsim_five_blocks,
    "multirate": _bdsim_multirate,
}


def pathsim_run(model: str) -> dict[str, Any]:
    blocks, connections, settings, duration, adaptive, outputs = PATHSIM[model]()
    from pathsim import Simulation

    simulation = Simulation(blocks, connections, log=False, **settings)
    start_time = time.perf_counter()
    message = simulation.run(duration, adaptive=adaptive)
    seconds = time.perf_counter() - start_time
    steps = int(message.get("total_steps", 0))
    return {"seconds": seconds, "steps": steps, "final": [float(block.outputs[0]) for block in outputs]}


def _pathsim_van_der_pol() -> tuple[Any, ...]:
    from pathsim import Connection
    from pathsim.blocks import Adder, Amplifier, Function, Integrator, Scope, Source
    from pathsim.solvers import RKDP54

    wave, e, kp = Source(lambda t: np.sin(2 * np.pi * 0.1 * t)), Adder("+-"), Amplifier(2.0)
    integral, ki, kd, u = Integrator(0.0), Amplifier(0.5), Amplifier(-0.5), Adder("+++")
    f = Function(lambda x1, x2, u: (1 - x1 * x1) * x2 - x1 + u)
    x2, x1, scope = Integrator(0.0), Integrator(1.0), Scope()
    wires = [
        Connection(wave, e[0]),
        Connection(x1, e[1], f[0], scope[0]),
        Connection(e, kp, integral),
        Connection(integral, ki),
        Connection(x2, kd, f[1], x1),
        Connection(kp, u[0]),
        Connection(ki, u[1]),
        Connection(kd, u[2]),
        Connection(u, f[2]),
        Connection(f, x2),
    ]
    settings = {"Solver": RKDP54, "dt": 1e-3, "tolerance_lte_rel": 1e-6, "tolerance_lte_abs": 1e-9}
    blocks = [wave, e, kp, integral, ki, kd, u, f, x2, x1, scope]
    return blocks, wires, settings, 100.0, True, [x1, x2]


def _pathsim_five_blocks() -> tuple[Any, ...]:
    from pathsim import Connection
    from pathsim.blocks import Adder, Amplifier, Integrator, Source
    from pathsim.solvers import RK4

    step, e, gain = Source(lambda t: 1.0), Adder("+--"), Amplifier(4.0)
    speed, place = Integrator(0.0), Integrator(0.0)
    wires = [
        Connection(step, e[0]),
        Connection(e, gain),
        Connection(gain, speed),
        Connection(speed, place, e[2]),
        Connection(place, e[1]),
    ]
    settings = {"Solver": RK4, "dt": 1e-3}
    return [step, e, gain, speed, place], wires, settings, 10.0, False, [place, speed]


PATHSIM: dict[str, Callable[[], tuple[Any, ...]]] = {
    "van_der_pol": _pathsim_van_der_pol,
    "five_blocks": _pathsim_five_blocks,
}


def main() -> None:
    sys.meta_path.insert(0, _PatchedBdsimFinder())
    replies, sys.stdout = sys.stdout, sys.stderr  # other output goes to standard error
    for line in sys.stdin:
        tool, model = line.split()
        run = {"bdsim": bdsim_run, "pathsim": pathsim_run}[tool]
        replies.write(json.dumps(run(model)) + "\n")
        replies.flush()


if __name__ == "__main__":
    main()
