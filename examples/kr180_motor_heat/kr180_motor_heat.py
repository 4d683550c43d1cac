"""At which payloads and cycle times the motors of a KR 180 PA overheat: 10 000 variants of a pallet cycle.

    python kr180_motor_heat.py OUT

varies the payload (0 to 180 kg) and the duration of the cycle of the shipped diagram
``kr180_pick_and_place``, and writes into the folder OUT: the table (``cycles.csv``), and for each joint a map
of the load of its motor (``base.svg`` …). The load is the RMS torque of the cycle, divided by the continuous
torque of the drive. The temperature of the winding rises with its square: above 1 the motor overheats.

The continuous torques are assumptions of this example; the manufacturer does not publish them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import armblocks as ab

CONTINUOUS = {"base": 1200.0, "shoulder": 4500.0, "elbow": 4500.0, "hand": 50.0}  # N m at the joint
DURATIONS = np.array([2.0, 0.8, 2.0, 1.6, 1.6, 2.0, 0.8, 2.0])  # s, the segments of the shipped cycle
GRIP, RELEASE = 2.7, 10.7  # s, in the shipped cycle
SHORTEST, LONGEST = 0.8, 1.4  # factors of the duration of the shipped cycle
PAYLOAD, CYCLE = "payload, kg", "cycle, s"


def variants(payloads: int, cycles: int) -> list[dict[str, object]]:
    """A row for each run: the payload, and all times of the cycle multiplied by one factor."""
    return [
        {
            "gripped.final[0]": mass,
            "released.final[0]": mass,
            "path.durations": (factor * DURATIONS).tolist(),
            "gripped.time": GRIP * factor,
            "released.time": RELEASE * factor,
        }
        for mass in np.linspace(0.0, 180.0, payloads).tolist()
        for factor in np.linspace(SHORTEST, LONGEST, cycles).tolist()
    ]


def main(out: Path, *, payloads: int = 100, cycles: int = 100) -> ab.SweepResult:
    """Compute all variants, and write the files."""
    out.mkdir(parents=True, exist_ok=True)
    measures: dict[str, str] = {}
    for k in range(len(CONTINUOUS)):
        measures |= {f"square{k}": f"ise(rne/tau[{k}])", f"rest{k}": f"final(rne/tau[{k}])"}
    # All runs end with the longest cycle. After a shorter one the arm rests; this part is subtracted below.
    stop = LONGEST * float(DURATIONS.sum())
    settings = {"stop_time": stop, "sample_time": 0.02}
    result = ab.sweep("kr180_pick_and_place", variants(payloads, cycles), measures=measures, **settings)
    duration = result["path.durations[0]"] / DURATIONS[0] * DURATIONS.sum()
    loads: dict[str, np.ndarray] = {CYCLE: duration, PAYLOAD: result["gripped.final[0]"]}
    for k, (name, torque) in enumerate(CONTINUOUS.items()):
        cycle = result[f"square{k}"] - result[f"rest{k}"] ** 2 * (stop - duration)
        loads[name] = np.sqrt(cycle / duration) / torque
    result = result.with_columns(loads)
    result.save(out / "cycles.csv")
    for name in CONTINUOUS:
        result.plot("map", name, parameters=(CYCLE, PAYLOAD), limit=1.0, save=out / f"{name}.svg")
    print(result)
    return result


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "kr180_motor_heat_results"))
