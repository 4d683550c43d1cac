"""Run roboticstoolbox and EAIK in a separate environment, for benchmarks/inverse_kinematics.py.

    python -m venv peers && peers/bin/pip install roboticstoolbox-python eaik 'numpy<2'

The argument is an npz file with the axes, limits and targets of one robot; the output is one JSON line.
"""

# The libraries have no type annotations.
# pyright: basic, reportMissingImports=false
from __future__ import annotations

import json
import sys
import time

import numpy as np

REPEATS = 3


def best(function, count: int) -> float:
    """Seconds of processor time for each of ``count`` targets, the best of several repetitions."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times) / count


def toolbox(data) -> dict[str, object]:
    """``ik_LM`` (C++) of an elementary transform sequence with the same axes, one target after the other."""
    import roboticstoolbox as rtb

    ets = rtb.ETS()
    before = np.eye(4)
    for frame, (low, high) in zip(data["frames"], data["limits"]):
        joint = rtb.ET.Rz(qlim=[float(low), float(high)])
        ets = ets * rtb.ET.SE3(np.linalg.solve(before, frame)) * joint
        before = frame
    ets = ets * rtb.ET.SE3(np.linalg.solve(before, data["tool"]))
    targets = list(data["targets"])
    result: dict[str, object] = {"version": rtb.__version__}
    for name, options in (("default", {}), ("chan", {"method": "chan", "k": 0.1})):
        found = [ets.ik_LM(T, **options) for T in targets]
        errors = [
            float(np.linalg.norm(ets.fkine(q[0]).A[:3, 3] - T[:3, 3])) for q, T in zip(found, targets) if q[1]
        ]
        result[name] = {
            "seconds": best(lambda o=options: [ets.ik_LM(T, **o) for T in targets], len(targets)),
            "solved": float(np.mean([q[1] for q in found])),
            "error": max(errors),
        }
    return result


def eaik(data) -> dict[str, object]:
    """All branches by EAIK, one target after the other and as a batch with one worker."""
    from eaik.IK_HP import HPRobot

    frames, tool = data["frames"], data["tool"]
    points = np.vstack([np.zeros(3), frames[:, :3, 3], tool[:3, 3]])
    robot = HPRobot(frames[:, :3, 2].copy(), np.diff(points, axis=0))
    targets = data["targets"].copy()
    targets[:, :3, :3] = targets[:, :3, :3] @ tool[:3, :3].T
    poses = list(targets)
    found = [robot.IK(T) for T in poses]
    exact = [int((~np.asarray(s.is_LS, dtype=bool)).sum()) for s in found]
    return {
        "branches": float(np.mean(exact)),
        "single": best(lambda: [robot.IK(T) for T in poses], len(poses)),
        "batch": best(lambda: robot.IK_batched(targets, 1), len(poses)),
    }


if __name__ == "__main__":
    content = np.load(sys.argv[1])
    peers = {"toolbox": toolbox, "eaik": eaik}
    print(json.dumps({name: peers[name](content) for name in sys.argv[2:]}))
