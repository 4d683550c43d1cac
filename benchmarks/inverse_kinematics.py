"""Inverse kinematics beside roboticstoolbox (ik_LM, C++) and EAIK (closed form, C++), on one thread.

    ARMBLOCKS_PEERS=peers/bin/python python benchmarks/inverse_kinematics.py

The other programs run in a separate environment (see inverse_kinematics_peers.py), directly after the
measurement of armblocks for the same robot, with the same axes, limits and targets. The targets are the poses
of random coordinates within the limits. The output is the tables for RESULTS.md.
"""

# pyright: basic
from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import armblocks as ab
from armblocks.dynamics.closed_form.axes import chain_of
from armblocks.face.ikine_coordinates import random_coordinates

ROBOTS = ("panda", "ur5", "puma560", "iiwa14")
CLOSED = ("puma560", "ur5")
COUNT, PEER_COUNT, SINGLE = 10_000, 2_000, 1_000
REPEATS = 7


def best(function: Callable[[], object], count: int) -> float:
    """Seconds of processor time for each of ``count`` targets, the best of several repetitions."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times) / count


def targets_of(arm: ab.Arm, count: int) -> np.ndarray:
    q = random_coordinates(arm.robot, count, np.random.default_rng(11), limited=True)
    return arm.fkine(q)


def peers(arm: ab.Arm, T: np.ndarray, names: tuple[str, ...]) -> dict:
    """The results of the other programs for the same arm."""
    python = os.environ.get("ARMBLOCKS_PEERS")
    if not python:
        return {}
    chain = chain_of(arm.robot, None)
    frames = []
    for axis in chain.axes:
        z = axis.direction * axis.factor
        x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        x /= np.linalg.norm(x)
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = np.column_stack((x, np.cross(z, x), z)), axis.point
        frames.append(frame)
    low, high = arm.robot.qlim.T
    limits = np.column_stack(
        (np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi))
    )
    # The peers' angles include the offsets of the joints.
    limits += np.array([axis.offset for axis in chain.axes])[:, np.newaxis]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.npz"
        np.savez(file, frames=np.array(frames), tool=chain.tool, limits=limits, targets=T)
        script = Path(__file__).with_name("inverse_kinematics_peers.py")
        done = subprocess.run([python, script, file, *names], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def iteration_rows() -> list[str]:
    rows = [
        "| robot | solved | largest error | batch | one by one "
        "| ik_LM | solved by ik_LM | error of ik_LM | ratio |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in ROBOTS:
        arm = ab.load_robot(name)
        T = targets_of(arm, COUNT)
        result = arm.ikine(T)
        solved = np.asarray(result.success)
        error = max(result.position_error[solved].max(), result.rotation_error[solved].max())
        batch = best(lambda arm=arm, T=T: arm.ikine(T), COUNT)
        single = best(lambda arm=arm, T=T: [arm.ikine(T[k]) for k in range(SINGLE)], SINGLE)
        row = f"| {name} | {solved.mean():.2%} | {error:.1e} | {batch * 1e6:.2f} µs | {single * 1e6:.1f} µs "
        found = peers(arm, T[:PEER_COUNT], ("toolbox",)).get("toolbox")
        if found:
            fast = min((found["default"], found["chan"]), key=lambda entry: entry["seconds"])
            seconds = fast["seconds"]
            row += f"| {seconds * 1e6:.0f} µs | {fast['solved']:.2%} | {fast['error']:.1e} m "
            row += f"| {seconds / batch:.0f} x, {seconds / single:.1f} x |"
        rows.append(row)
    return rows


def reason_rows() -> list[str]:
    rows = ["| robot | reported as out of reach | time each |", "| --- | --- | --- |"]
    for name in ROBOTS:
        arm = ab.load_robot(name)
        T = targets_of(arm, 1000)
        size = chain_of(arm.robot, None).size
        direction = T[:, :3, 3] / np.linalg.norm(T[:, :3, 3], axis=1, keepdims=True)
        T[:, :3, 3] = direction * np.random.default_rng(2).uniform(1.05, 3.0, (1000, 1)) * size
        result = arm.ikine(T)
        named = np.mean(result.reason == "out of reach")
        seconds = best(lambda arm=arm, T=T: arm.ikine(T), 1000)
        rows.append(f"| {name} | {named:.1%} | {seconds * 1e6:.0f} µs |")
    return rows


def closed_rows() -> list[str]:
    rows = [
        "| robot | branches | largest error | batch | one by one "
        "| EAIK branches | EAIK batch | EAIK one by one | ratio |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in CLOSED:
        arm = ab.load_robot(name)
        T = targets_of(arm, COUNT)
        result = arm.ikine_all(T, limits=False)
        error = max(np.nanmax(result.position_error), np.nanmax(result.rotation_error))
        batch = best(lambda arm=arm, T=T: arm.ikine_all(T, limits=False), COUNT)
        single = best(lambda arm=arm, T=T: [arm.ikine_all(T[k], limits=False) for k in range(SINGLE)], SINGLE)
        row = f"| {name} | {result.count.mean():.2f} | {error:.1e} "
        row += f"| {batch * 1e6:.2f} µs | {single * 1e6:.0f} µs "
        found = peers(arm, T[:PEER_COUNT], ("eaik",)).get("eaik")
        if found:
            row += (
                f"| {found['branches']:.2f} | {found['batch'] * 1e6:.1f} µs | {found['single'] * 1e6:.1f} µs "
            )
            row += f"| {found['batch'] / batch:.1f} x in a batch |"
        rows.append(row)
    return rows


if __name__ == "__main__":
    print(f"{os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}")
    print(f"load average at the start {os.getloadavg()[0]:.2f}")
    for table in (iteration_rows, reason_rows, closed_rows):
        print("\n" + "\n".join(table()))
        sys.stdout.flush()
    print(f"\nload average at the end {os.getloadavg()[0]:.2f}")
