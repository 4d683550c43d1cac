"""From a URDF file to a time-optimal pick-and-place cycle, its drives, and a video.

    python pick_and_place_cell.py OUT [--film]

writes into the folder OUT: the motion against its limits (``motion.svg``), the comparison of the drives
(``sizing/sizing.html``), the reachable region with the payload capacity (``workspace.svg``), and with
``--film`` the video ``cycle.mp4`` (extra ``film``).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import armblocks as ab

HERE = Path(__file__).parent
PAYLOAD = 5.0  # kg
START = [0.0, 0.3, 0.2, 0.0, 1.0, 0.0]  # rad
GRIP_HEIGHT = 0.05  # m between the tool and the tables


def tool_down(x: float, y: float, z: float) -> np.ndarray:
    """The pose (4, 4) of the tool at a position (m), with its z axis down."""
    T = np.diag([-1.0, 1.0, -1.0, 1.0])
    T[:3, 3] = x, y, z
    return T


def main(out: Path, *, film: bool) -> ab.SizingReport:
    """Plan the cycle, check it, size the drives, and write the files."""
    out.mkdir(parents=True, exist_ok=True)
    arm = ab.load_robot(HERE / "cell_arm.urdf")

    tables = [
        ab.Box(size=(0.4, 0.4, 0.3), pose=ab.Transform(translation=(0.6, -0.4, 0.15)), name="conveyor"),
        ab.Box(size=(0.4, 0.4, 0.5), pose=ab.Transform(translation=(0.5, 0.5, 0.25)), name="pallet"),
    ]
    cycle = ab.pick_and_place(
        arm,
        START,
        pick=tool_down(0.6, -0.4, 0.3 + GRIP_HEIGHT),
        place=tool_down(0.5, 0.5, 0.5 + GRIP_HEIGHT),
        lift=0.15,
        grip_time=0.15,
        payload=PAYLOAD,
        acceleration=25.0,
    )
    print(cycle)

    report = ab.trajectory_report(arm, cycle, payload=PAYLOAD, acceleration=25.0)
    print(report)
    report.save(out / "motion.svg")

    contacts = ab.collisions(arm, cycle.trajectory, [ab.Plane(name="floor"), *tables])
    print(contacts)

    region = ab.workspace(arm, 500_000, measures="payload")
    print(region)
    region.save(out / "workspace.svg")

    sizing = ab.size_drives(arm, cycle, ab.load_drives(HERE / "motors.csv"), payload=PAYLOAD, pause=0.3)
    print(sizing)
    sizing.write(out / "sizing")

    if film:
        arm.animate(cycle.trajectory, save=out / "cycle.mp4")
    return sizing


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"), film="--film" in sys.argv)
