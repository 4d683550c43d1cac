"""The example that tunes a PID controller for one motor and for a range of motors."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "robust_pid" / "robust_pid.py"


def test_the_robust_controller_keeps_the_limits_with_more_motors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example = runpy.run_path(str(EXAMPLE))
    compared = example["main"](tmp_path / "out", scenarios=8, evaluations=60, motors=64)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"{name}{ending}"
        for name in ("nominal", "robust")
        for ending in (".csv", "_speed.svg", "_response.svg")
    }
    text = capsys.readouterr().out
    assert "the quantile 0.9 of 8 scenarios" in text and "motors within both limits" in text
    nominal, robust = compared.motors["nominal"], compared.motors["robust"]
    # The same random motors; none of them is a scenario of the tuning.
    for name in example["MOTORS"]:
        assert np.array_equal(nominal[name], robust[name])
    scenarios = [scenario["motor.J"] for scenario in compared.tuned["robust"].scenarios]
    assert not np.isin(robust["motor.J"], scenarios).any()
    shares = {name: motors.probability("excess", high=0.0)[0] for name, motors in compared.motors.items()}
    assert shares["robust"] > 0.6 and shares["nominal"] < 0.3
    # The limits cost speed.
    assert np.median(robust["itae"]) > 1.2 * np.median(nominal["itae"])
    # A motor of the comparison as a run of its own.
    worst = int(nominal.largest("excess")[0])
    run = nominal.run(worst)
    current = float(np.abs(run["motor/i"]).max()) / example["CURRENT"]
    fastest = float(run["motor/w"].max()) / example["FASTEST"]
    assert max(current, fastest) - 1.0 == pytest.approx(nominal["excess"][worst], abs=1e-12)
