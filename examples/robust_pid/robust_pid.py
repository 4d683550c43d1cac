"""A PID controller of a DC motor, tuned for one motor and for a range of motors.

    python robust_pid.py OUT

tunes the gains of the shipped diagram ``dc_motor_sampled_pid`` twice. The nominal controller has the smallest
objective with the parameters of the diagram. The robust controller has the smallest quantile 0.9 of the
objective over 32 scenarios, in which inertia, resistance, torque constant and load torque differ. The limits
of speed and current hold in all of them. Both controllers are then compared with 2000 other random motors.

The folder OUT gets three files for each controller: the table of these motors (``nominal.csv``,
``robust.csv``), the bands of the speed over time (``…_speed.svg``), and the excess over the limits against
each parameter (``…_response.svg``).

The ranges of the parameters are assumptions of this example.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import armblocks as ab

MODEL = "dc_motor_sampled_pid"
GAINS = {"controller.P": ab.loguniform(0.05, 5.0), "controller.I": ab.loguniform(0.1, 50.0)}
OBJECTIVE = "itae({speed reference/y} - {motor/w})"
FASTEST, CURRENT = 105.0, 35.0  # rad/s, A
LIMITS = [f"maximum(motor/w) <= {FASTEST}", f"peak(motor/i) <= {CURRENT}"]
MOTORS = {
    "motor.J": ab.uniform(0.006, 0.016),  # kg m^2, with the inertia of the load
    "motor.R": ab.uniform(1.0, 1.6),  # ohm, cold to warm winding
    "motor.k": ab.uniform(0.22, 0.27),  # N m/A, warm to cold magnets
    "load.final": ab.uniform(0.0, 1.0),  # N m
}
MEASURES = {"itae": OBJECTIVE, "fastest": "maximum(motor/w)", "current": "peak(motor/i)"}
SAMPLE_TIME = 0.005  # s


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """The tuned controllers, ``nominal`` and ``robust``, and the same random motors with each of them."""

    tuned: Mapping[str, ab.OptimisationResult]
    motors: Mapping[str, ab.SweepResult]

    def __str__(self) -> str:
        lines = ["controller  median ITAE  90 % below  motors within both limits"]
        for name, motors in self.motors.items():
            share, low, high = motors.probability("excess", high=0.0)
            median, ninety = quantile(motors, 0.5), quantile(motors, 0.9)
            lines.append(
                f"{name:<10}  {median:11.2f}  {ninety:10.2f}  "
                f"{share:.1%}, between {low:.1%} and {high:.1%} with 95 % confidence"
            )
        return "\n".join(lines)


def quantile(motors: ab.SweepResult, share: float) -> float:
    """The objective that this share of the motors does not exceed."""
    return float(sorted(motors["itae"])[int(share * len(motors))])


def main(out: Path, *, scenarios: int = 32, evaluations: int = 600, motors: int = 2000) -> Comparison:
    """Tune both controllers, compare them, and write the files."""
    out.mkdir(parents=True, exist_ok=True)
    search = {"method": "search", "evaluations": evaluations, "sample_time": SAMPLE_TIME}
    tuned = {
        "nominal": ab.optimise(MODEL, GAINS, OBJECTIVE, LIMITS, **search),
        "robust": ab.optimise(
            MODEL,
            GAINS,
            OBJECTIVE,
            LIMITS,
            over=MOTORS,
            runs=scenarios,
            design="sobol",
            statistic=0.9,
            **search,
        ),
    }
    compared: dict[str, ab.SweepResult] = {}
    for name, result in tuned.items():
        print(result, end="\n\n")
        # Random values, independent of the scenarios, so that the confidence intervals are valid.
        table = ab.sweep(
            result.diagram,
            MOTORS,
            runs=motors,
            seed=1,
            measures=MEASURES,
            keep="motor/w",
            sample_time=SAMPLE_TIME,
        )
        # The larger relative excess over the two limits, negative within both.
        excess = [max(w / FASTEST, i / CURRENT) - 1.0 for w, i in zip(table["fastest"], table["current"])]
        table = table.with_columns({"excess": excess})
        table.save(out / f"{name}.csv")
        table.plot("bands", "motor/w", save=out / f"{name}_speed.svg")
        table.plot("response", "excess", save=out / f"{name}_response.svg")
        compared[name] = table
    comparison = Comparison(tuned=tuned, motors=compared)
    print(comparison)
    return comparison


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "robust_pid_results"))
