"""Start-up times: import, first result, complete report."""

from __future__ import annotations

import os
import subprocess
import tempfile
import time

from measure import PYTHON, Timing, process_in_turn

FIRST_RNE = "import armblocks as ab; arm = ab.load_robot('puma560'); arm.rne([0]*6, [0]*6, [1]*6)"


def imports(repeats: int) -> tuple[Timing, Timing]:
    """Times of the processes that import ``numpy``, and ``numpy`` with ``armblocks``."""
    numpy, armblocks = process_in_turn(
        [[PYTHON, "-c", "import numpy"], [PYTHON, "-c", "import numpy, armblocks"]], repeats
    )
    return numpy, armblocks


def first_result(repeats: int) -> tuple[Timing, Timing]:
    """Times from process start to the first rne of the Puma 560, with an empty and with a filled cache."""
    cold = []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            cold.append(cold_first_result(folder))
    with tempfile.TemporaryDirectory() as folder:
        [warm] = process_in_turn([[PYTHON, "-c", FIRST_RNE]], repeats, env={"ARMBLOCKS_CACHE_DIR": folder})
    return Timing(tuple(cold)), warm


def cold_first_result(folder: str) -> float:
    """Wall time of one process with an empty cache, s."""
    start = time.perf_counter()
    subprocess.run([PYTHON, "-c", FIRST_RNE], check=True, env={**os.environ, "ARMBLOCKS_CACHE_DIR": folder})
    return time.perf_counter() - start


def complete_report(repeats: int) -> Timing:
    """Wall time of ``armblocks run kr180model`` with all figures and filled caches."""
    with tempfile.TemporaryDirectory() as folder:
        command = [PYTHON, "-m", "armblocks", "run", "kr180model", "--out", f"{folder}/report"]
        [timing] = process_in_turn([command], repeats)
    return timing
