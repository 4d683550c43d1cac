"""Thinned curves on the documentation pages have fewer points and look the same."""

import runpy
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

LIGHT = runpy.run_path(str(Path(__file__).resolve().parents[2] / "docs" / "light_pictures.py"))
X = np.linspace(0.0, 600.0, 601)
TURN = np.linspace(0.0, 2 * np.pi, 400)
CURVES = {
    "sine": np.stack([X, 60 * np.sin(X / 40)], axis=1),
    "jump": np.stack([X, np.where(X < 200, 0.0, 90.0)], axis=1),
    "noise": np.stack([X, np.random.default_rng(5).normal(size=X.size).cumsum()], axis=1),
    "straight": np.stack([X, X / 3], axis=1),
    "circle": 50 * np.stack([np.cos(TURN), np.sin(TURN)], axis=1),
    "rest": np.ones((100, 2)),
}


@pytest.mark.parametrize("name", CURVES)
def test_omitted_points_are_within_the_tolerance_of_the_drawn_line(name: str) -> None:
    points = CURVES[name]
    indices = np.flatnonzero(LIGHT["selected_points"](points))
    assert indices[0] == 0
    assert indices[-1] == len(points) - 1
    for first, last in pairwise(indices):
        chord = points[last] - points[first]
        length = max(float(chord @ chord), 1e-30)
        inner = points[first : last + 1] - points[first]
        along = np.clip(inner @ chord / length, 0.0, 1.0)
        assert np.linalg.norm(inner - along[:, None] * chord, axis=1).max() <= LIGHT["TOLERANCE"] + 1e-12


def test_smooth_curves_lose_most_of_their_points() -> None:
    counts = {name: int(LIGHT["selected_points"](points).sum()) for name, points in CURVES.items()}
    assert counts["straight"] == counts["rest"] == 2
    assert counts["jump"] == 4
    assert counts["sine"] < 150
    assert counts["circle"] < 100
