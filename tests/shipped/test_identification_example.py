"""The example that identifies a Puma from noisy measurements."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab

EXAMPLE = Path(__file__).parents[2] / "examples" / "puma_identification" / "puma_identification.py"


def test_a_puma_is_identified_from_noisy_torques(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(EXAMPLE))
    published = ab.load_robot("puma560")
    result = example["main"](tmp_path / "out", evaluations=5, dt=0.01)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "log.csv",
        "identified.json",
        "torques.svg",
    }
    assert "identified robot" in capsys.readouterr().out

    real = example["measured_arm"](published)
    q, qd, qdd = (np.random.default_rng(0).uniform(-size, size, (100, 6)) for size in (1.0, 1.0, 3.0))
    torque, before, after = (arm.rne(q, qd, qdd) for arm in (real, published, result.arm))
    before, after = (np.sqrt(np.mean((computed - torque) ** 2, axis=0)) for computed in (before, after))
    assert (after < 0.3 * before).all()
