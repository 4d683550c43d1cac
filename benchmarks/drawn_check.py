"""The check of the studio after an edit of a mechanism that is drawn from 100 bodies.

    python benchmarks/drawn_check.py [bodies]

A chain of revolute joints. Every edit changes a length, so that no traced equations can be reused. Processor
time of this process, least of five.
"""

from __future__ import annotations

import sys
import time

from armblocks.blocks import BrickSolid, MechanismConfiguration, RevoluteJoint, RigidTransform, WorldFrame
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.studio.sheet.check import check


def chain(bodies: int, length: float) -> Diagram:
    """An unchecked diagram, as after an edit; ``length`` of the rods in m."""
    builder = DiagramBuilder("chain")
    end = builder.add("world", WorldFrame())["W"]
    builder.add("gravity", MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=end)
    for k in range(bodies):
        joint = builder.add(f"hinge{k}", RevoluteJoint(), B=end)
        rod = builder.add(f"rod{k}", RigidTransform(translation=(0.0, -length, 0.0)), B=joint["F"])
        builder.add(f"brick{k}", BrickSolid(dimensions=(0.03, 0.04, 0.01)), R=rod["F"])
        end = rod["F"]
    return builder.draft()


def main() -> None:
    """Print the time of a check."""
    bodies = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    check(chain(3, 0.1))
    times: list[float] = []
    for k in range(5):
        diagram = chain(bodies, 0.1 + 0.01 * k)
        started = time.process_time()
        findings, _ = check(diagram)
        times.append(time.process_time() - started)
        assert not findings
    print(f"check of {bodies} bodies after an edit: {min(times):.3f} s (largest {max(times):.3f} s)")


if __name__ == "__main__":
    main()
