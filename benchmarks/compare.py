"""Compare the run times of two or more checkouts, measured in alternation.

    python benchmarks/compare.py OLD NEW [--turns 40] [--only multirate]

``OLD`` and ``NEW`` are folders of checkouts. One process for each checkout compiles every model once. The
processes then run in alternation, about 20 ms each. Times are processor time (user and system, all threads),
so that other load on the machine affects them only through caches and clock frequency. The output contains
the minimum, the lower quartile and their ratios, old to new. Above 1, the new checkout is faster.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import armblocks as ab

TURN_SECONDS = 0.02


def five_blocks() -> ab.Diagram:
    """Return the diagram of a second-order system."""
    # Imported here: the measured checkout provides armblocks.
    import armblocks as ab
    from armblocks.blocks import Gain, Integrator, Step, Sum

    builder = ab.DiagramBuilder("five blocks")
    total = builder.add("total", Sum(signs="+--"), builder.add("step", Step(time=0.0, final=1.0)))
    speed = builder.add("speed", Integrator(), builder.add("gain", Gain(gain=4.0), total))
    place = builder.add("place", Integrator(), speed)
    builder.connect(place, total["u2"])
    builder.connect(speed, total["u3"])
    return builder.build()


def measured_functions() -> dict[str, Callable[[], object]]:
    """Return the measured functions by name. Each was called once, so that it is compiled."""
    import numpy as np

    import armblocks as ab

    def run_of(diagram: ab.Diagram, **options: Any) -> Callable[[], object]:
        return lambda: ab.simulate(diagram, **options)

    functions: dict[str, Callable[[], object]] = {
        name: run_of(ab.load_diagram(model))
        for name, model in (
            ("A kr180model", "kr180model"),
            ("B computed torque", "puma560_computed_torque"),
            ("C van der Pol, PID", "van_der_pol_pid"),
            ("multirate", "puma560_multirate"),
        )
    }
    fixed = {"stop_time": 10.0, "step": 1e-3, "solver": "rk4", "sample_time": 0.01}
    functions["five blocks"] = run_of(five_blocks(), **fixed)
    arm = ab.load_robot("puma560").nofriction("all")
    q, qd, qdd = np.random.default_rng(0).uniform(-2, 2, (3, 100_000, arm.n))
    out = np.empty_like(q)
    functions["puma560 rne, 100 000"] = lambda: arm.rne(q, qd, qdd, out=out)
    functions["puma560 jacob0, 100 000, new array"] = lambda: arm.jacob0(q)
    functions["puma560 inertia, 100 000, new array"] = lambda: arm.inertia(q)
    few = [array[:8].copy() for array in (q, qd, qdd)]
    one = [array[0].copy() for array in (q, qd, qdd)]
    functions["puma560 rne, 8 samples"] = lambda: arm.rne(*few)
    functions["puma560 rne, one sample"] = lambda: arm.rne(*one)
    for function in functions.values():
        function()
    return functions


def serve() -> None:
    """Measure one turn of each function named on standard input, in the process of a checkout."""
    import armblocks

    functions = measured_functions()
    counts: dict[str, int] = {}
    print(json.dumps([str(Path(armblocks.__file__).parents[2]), list(functions)]), flush=True)
    for line in sys.stdin:
        name = json.loads(line)
        function = functions[name]
        if name not in counts:
            start = time.perf_counter()
            function()
            counts[name] = max(1, round(TURN_SECONDS / (time.perf_counter() - start)))
        start = time.process_time()
        for _ in range(counts[name]):
            function()
        print(json.dumps((time.process_time() - start) / counts[name]), flush=True)


class Checkout:
    """Connection to the process of a checkout."""

    def __init__(self, folder: Path) -> None:
        command = [sys.executable, str(Path(__file__).resolve()), "--serve"]
        environment = {**os.environ, "PYTHONPATH": str(folder / "src")}
        self._process = subprocess.Popen(
            command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.folder, self.names = self._reply()

    def turn(self, name: str) -> float:
        """Return the processor time of one call in s, as a mean over one turn."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(name) + "\n")
        self._process.stdin.flush()
        return self._reply()

    def _reply(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"the process of a checkout ended with exit code {self._process.wait()}")
        return json.loads(line)

    def close(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("checkouts", nargs="*", type=Path)
    parser.add_argument("--turns", type=int, default=40)
    parser.add_argument("--only", default="", help="measure only functions whose names contain this text")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        serve()
        return
    checkouts = [Checkout(folder.resolve()) for folder in arguments.checkouts]
    for checkout in checkouts:
        print(checkout.folder)
    print(f"{'µs, smallest / lower quartile':36}" + "".join(f"{k + 1:>22}" for k in range(len(checkouts))))
    for name in checkouts[0].names:
        if arguments.only not in name:
            continue
        seconds: list[list[float]] = [[] for _ in checkouts]
        for _ in range(arguments.turns):
            for row, checkout in zip(seconds, checkouts):
                row.append(checkout.turn(name))
        cells = [(1e6 * min(row), 1e6 * statistics.quantiles(row, n=4)[0]) for row in seconds]
        text = "".join(f"{minimum:>12.2f} /{quartile:>8.2f}" for minimum, quartile in cells)
        ratios = [f"{cells[0][k] / cells[-1][k]:.2f}" for k in (0, 1)]
        print(f"{name:36}{text}   {' / '.join(ratios)}", flush=True)
    for checkout in checkouts:
        checkout.close()


if __name__ == "__main__":
    main()
