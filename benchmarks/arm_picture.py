"""The first picture of an arm in a new process, beside roboticstoolbox with matplotlib.

``python benchmarks/arm_picture.py [PYTHON]``: PYTHON is an interpreter with ``roboticstoolbox-python``, by
default this one. Processor time of complete processes in alternation, the least of the repetitions.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

REPEATS = 7
OURS = "import armblocks as ab; ab.load_robot('puma560').plot([0, .785, 3.14, 0, .785, 0], save='{file}')"
PEER = """
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import roboticstoolbox as rtb
arm = rtb.models.DH.Puma560()
arm.plot(arm.qn, backend="pyplot", block=False)
plt.savefig("{file}")
"""


def processor_time(python: str, code: str) -> float:
    """Processor time (s) of a process that runs the code."""
    before = os.times()
    subprocess.run([python, "-c", code], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    """Print the least processor times."""
    peer_python = sys.argv[1] if len(sys.argv) > 1 else sys.executable
    with tempfile.TemporaryDirectory() as folder:
        rows = {
            "armblocks, PNG": (sys.executable, OURS.format(file=f"{folder}/a.png")),
            "armblocks, SVG": (sys.executable, OURS.format(file=f"{folder}/a.svg")),
            "roboticstoolbox, PNG": (peer_python, PEER.format(file=f"{folder}/b.png")),
        }
        times: dict[str, list[float]] = {name: [] for name in rows}
        for _ in range(REPEATS):
            for name, (python, code) in rows.items():
                times[name].append(processor_time(python, code))
    for name, values in times.items():
        print(f"{name}: {min(values):.2f} s")


if __name__ == "__main__":
    main()
