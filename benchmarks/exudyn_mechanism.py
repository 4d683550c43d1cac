"""A mechanism in Exudyn: free bodies with constraints, generalised-alpha of index 3, steps of 1 ms.

Called by `mechanism_peers.py` with a description on standard input, in an environment with Exudyn. Prints the
processor time of the run (s), the centres of mass at its end and the largest gap of the joints (m) as JSON.
"""

# pyright: basic
from __future__ import annotations

import json
import sys
import time

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    GenericJoint,
    MarkerBodyPosition,
    MarkerBodyRigid,
    ObjectGround,
    SpringDamper,
)
from exudyn.rigidBodyUtilities import AddRigidBody, RigidBodyInertia

CONSTRAINED = {
    "rev": [1, 1, 1, 1, 1, 0],
    "pri": [1, 1, 0, 1, 1, 1],
    "sph": [1, 1, 1, 0, 0, 0],
    "uni": [1, 1, 1, 0, 0, 1],  # the x axis of the first and the y axis of the second frame are perpendicular
}


def main() -> None:
    case = json.load(sys.stdin)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    bodies = {None: mbs.AddObject(ObjectGround())}
    places = {None: (np.eye(3), np.zeros(3))}
    for name, body in case["bodies"].items():
        R, p = np.array(body["R"]), np.array(body["com"])
        inertia = RigidBodyInertia(mass=body["mass"], inertiaTensor=np.array(body["inertia_body_axes"]))
        _, bodies[name] = AddRigidBody(
            mainSys=mbs,
            inertia=inertia,
            nodeType=exu.NodeType.RotationEulerParameters,
            position=p,
            velocity=body["v"],
            rotationMatrix=R,
            angularVelocity=body["omega"],
            gravity=case["gravity"],
        )
        places[name] = R, p
    joints = []
    for kind, a, b, point, R in case["joints"]:
        markers, rotations = [], []
        for name in (a, b):
            own, p = places[name]
            local = own.T @ (np.array(point) - p)
            markers.append(mbs.AddMarker(MarkerBodyRigid(bodyNumber=bodies[name], localPosition=local)))
            rotations.append(own.T @ np.array(R))
        joint = GenericJoint(
            markerNumbers=markers,
            constrainedAxes=CONSTRAINED[kind],
            rotationMarker0=rotations[0],
            rotationMarker1=rotations[1],
        )
        mbs.AddObject(joint)
        joints.append(markers)
    for spring in case["springs"]:
        ends = []
        for end in "ab":
            own, p = places[spring[end]]
            local = own.T @ (np.array(spring[f"p{end}"]) - p)
            ends.append(
                mbs.AddMarker(MarkerBodyPosition(bodyNumber=bodies[spring[end]], localPosition=local))
            )
        damper = SpringDamper(markerNumbers=ends, stiffness=spring["k"], referenceLength=spring["L0"])
        mbs.AddObject(damper)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = case["stop_time"]
    settings.timeIntegration.numberOfSteps = round(1000 * case["stop_time"])
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.solutionSettings.writeSolutionToFile = False
    settings.linearSolverType = exu.LinearSolverType.EigenDense
    settings.linearSolverSettings.ignoreSingularJacobian = True
    start = time.process_time()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    seconds = time.process_time() - start

    def position(marker: int) -> np.ndarray:
        return np.array(mbs.GetMarkerOutput(marker, exu.OutputVariableType.Position))

    kinds = [joint[0] for joint in case["joints"]]
    gaps = [np.linalg.norm(position(i) - position(j)) for kind, (i, j) in zip(kinds, joints) if kind != "pri"]
    centres = {
        name: np.array(mbs.GetObjectOutputBody(bodies[name], exu.OutputVariableType.Position)).tolist()
        for name in case["bodies"]
    }
    print(json.dumps({"seconds": seconds, "centres": centres, "gap": float(max(gaps))}))


if __name__ == "__main__":
    main()
