"""Sweeps of one core: against one run after the other, and against SciPy.

    python benchmarks/sweeps.py

Processor time per run, minimum of the repetitions in alternation, after the compilation. The van der Pol
oscillator (mu = 1, 20 s, relative tolerance 1e-6, absolute tolerance 1e-8) starts from 10 000 points.
"""

# pyright: basic
from __future__ import annotations

import os
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.integrate import odeint, solve_ivp

import armblocks as ab
from armblocks import blocks

RUNS, SINGLE_RUNS, PEER_RUNS, REPEATS = 10_000, 200, 30, 5
TORQUE_RUNS = 400
START = np.random.default_rng(0).uniform(-2, 2, (RUNS, 2))
SETTINGS = {"stop_time": 20.0, "rtol": 1e-6, "atol": 1e-8, "solver": "rk45"}
END = {"x": "final(x/y)", "v": "final(v/y)"}


def van_der_pol() -> ab.Diagram:
    """``x'' = mu (1 - x^2) x' - x`` as blocks."""
    builder = ab.DiagramBuilder("van der Pol")
    x, v = builder.add("x", blocks.Integrator()), builder.add("v", blocks.Integrator())
    law = builder.add("law", blocks.Expression(formula="(1 - u1^2)*u2 - u1", inputs=2), x, v)
    builder.connect(law["y"], v["u"])
    builder.connect(v["y"], x["u"])
    return builder.build()


def short_run() -> ab.Diagram:
    """``x' = -x`` for one step."""
    builder = ab.DiagramBuilder("short")
    x = builder.add("x", blocks.Integrator(initial=1.0))
    builder.connect(builder.add("gain", blocks.Gain(gain=-1.0), x)["y"], x["u"])
    return builder.build()


def least_seconds(functions: dict) -> dict[str, float]:
    """The least processor time per run of each function, which returns its number of runs."""
    least = dict.fromkeys(functions, np.inf)
    for function in functions.values():
        function()
    for _ in range(REPEATS):
        for name, function in functions.items():
            start = time.process_time()
            count = function()
            least[name] = min(least[name], (time.process_time() - start) / count)
    return least


def computed_torque() -> None:
    """Runs of the Puma 560 under computed torque, 10 s, each with other gains and another start."""
    model = ab.compile_diagram(ab.load_diagram("puma560_computed_torque"))
    vary = {"KP.gain": ab.uniform(50, 200), "KD.gain": ab.uniform(10, 40), "arm.q0[1]": ab.uniform(-0.2, 0.2)}
    measures = {"error": "peak({angle error/y[1]})", "rms": "rms(arm/q[1])"}
    tables = {}

    def sweep(lanes: bool) -> int:
        tables[lanes] = ab.sweep(
            model, vary, runs=TORQUE_RUNS, measures=measures, threads=1, sample_time=0.1, lanes=lanes
        )
        return TORQUE_RUNS

    for name, seconds in least_seconds(
        {"in lanes": lambda: sweep(True), "one run at a time": lambda: sweep(False)}
    ).items():
        print(f"computed torque of the Puma, {name}: {seconds * 1e6:.0f} us a run")
    assert all((tables[True][name] == tables[False][name]).all() for name in tables[True].names)


def rate(t, y) -> list:
    return [y[1], (1 - y[0] ** 2) * y[1] - y[0]]


def main() -> None:
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    model = ab.compile_diagram(van_der_pol())
    points = [{"x.initial": x, "v.initial": v} for x, v in START.tolist()]

    def sweep(sample_time: float, lanes: bool) -> int:
        more = {**SETTINGS, "sample_time": sample_time, "lanes": lanes}
        result = ab.sweep(model, points, measures=END, threads=1, **more)
        assert (result["status"] == "completed").all() and not result.remark
        return RUNS

    def singly(sample_time: float) -> int:
        for point in points[:SINGLE_RUNS]:
            ab.simulate(model, parameters=point, sample_time=sample_time, **SETTINGS)
        return SINGLE_RUNS

    def by_solve_ivp() -> int:
        for start in START[:PEER_RUNS]:
            solve_ivp(rate, (0, 20), start, method="RK45", rtol=1e-6, atol=1e-8)
        return PEER_RUNS

    def by_odeint() -> int:
        for start in START[:PEER_RUNS]:
            odeint(rate, start, [0.0, 20.0], tfirst=True, rtol=1e-6, atol=1e-8)
        return PEER_RUNS

    for name, seconds in least_seconds(
        {
            "sweep in lanes, last sample": lambda: sweep(20.0, True),
            "sweep in lanes, 1001 samples": lambda: sweep(0.02, True),
            "sweep, one run at a time, last sample": lambda: sweep(20.0, False),
            "sweep, one run at a time, 1001 samples": lambda: sweep(0.02, False),
            "simulate, last sample": lambda: singly(20.0),
            "simulate, 1001 samples": lambda: singly(0.02),
            "SciPy solve_ivp RK45": by_solve_ivp,
            "SciPy odeint": by_odeint,
        }
    ).items():
        print(f"van der Pol, {name}: {seconds * 1e6:.1f} us a run")
    reference = [solve_ivp(rate, (0, 20), s, rtol=1e-11, atol=1e-12).y[:, -1] for s in START[:PEER_RUNS]]
    ours = ab.sweep(model, points[:PEER_RUNS], measures=END, **SETTINGS)
    error = np.abs(np.column_stack([ours["x"], ours["v"]]) - reference).max()
    print(f"largest difference from solve_ivp at 1e-11: {error:.1e}")
    computed_torque()
    short, settings = short_run(), {"stop_time": 0.01, "sample_time": 0.01, "solver": "rk4", "step": 0.01}

    def many(runs: int, **more) -> int:
        vary, measures = {"x.initial": ab.uniform(0, 1)}, {"end": "final(x/y)"}
        ab.sweep(short, vary, runs=runs, measures=measures, threads=1, **settings, **more)
        return runs

    least = least_seconds({"in memory": lambda: many(200_000)})
    print(f"one step, in memory: {least['in memory'] * 1e6:.2f} us a run")
    with tempfile.TemporaryDirectory() as folder:
        for runs in (1_000, 100_000, 1_000_000):
            before = time.process_time()
            many(runs, out=Path(folder) / f"{runs}.parquet")
            seconds = (time.process_time() - before) / runs
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(f"one step, {runs} runs to Parquet: {seconds * 1e6:.2f} us a run, peak {peak:.0f} MB")


if __name__ == "__main__":
    main()
