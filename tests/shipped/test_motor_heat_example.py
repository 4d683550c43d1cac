"""The example that shows at which payloads and cycle times motors overheat."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "kr180_motor_heat" / "kr180_motor_heat.py"


def test_motors_overheat_with_heavy_payloads_and_short_cycles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example = runpy.run_path(str(EXAMPLE))
    result = example["main"](tmp_path / "out", payloads=3, cycles=2)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "cycles.csv",
        *(f"{name}.svg" for name in ("base", "shoulder", "elbow", "hand")),
    }
    assert "6 runs" in capsys.readouterr().out
    base, shoulder = result["base"].reshape(3, 2), result["shoulder"].reshape(3, 2)
    # Accelerations determine the load of the vertical axis, gravity that of the shoulder.
    assert (np.diff(base, axis=0) > 0.0).all() and (base[:, 0] > 2.0 * base[:, 1]).all()
    assert (np.diff(shoulder, axis=0) > 0.0).all() and np.abs(np.diff(shoulder, axis=1)).max() < 0.05
    # The longest cycle has no rest, so that its load is the RMS of the torque of a single run.
    torque = result.run(3)["rne/tau"][:, 0]
    rms = np.sqrt(np.mean(torque**2)) / example["CONTINUOUS"]["base"]
    assert base[1, 1] == pytest.approx(rms, rel=0.02)
