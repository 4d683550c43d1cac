"""The native grid of cells, compared with NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from armblocks.cell_maps.grid import CellGrid
from armblocks.errors import InputError


def by_numpy(points: np.ndarray, values: np.ndarray, cell: float, anchor: np.ndarray) -> dict:
    """Count, sum, largest and smallest value of each visited cell, by its indices."""
    found: dict[tuple[int, ...], list] = {}
    indices = np.floor((points.T - anchor) / cell + 0.5).astype(int)
    for index, value in zip(map(tuple, indices.tolist()), values.T):
        found.setdefault(index, []).append(value)
    return {key: (len(v), np.sum(v, 0), np.max(v, 0), np.min(v, 0)) for key, v in found.items()}


@pytest.mark.parametrize("count", [0, 1, 2])
def test_cells_have_the_statistics_of_their_samples(count: int) -> None:
    random = np.random.default_rng(3 + count)
    grid = CellGrid(0.25, np.array([0.1, -0.2, 0.03]), count, "test")
    points, values = [], []
    for chunk in range(6):  # each chunk is wider than the one before, so that the box grows
        points.append(random.normal(size=(3, 400)) * (chunk + 1) * np.array([[0.4], [0.2], [0.1]]))
        values.append(random.normal(size=(count, 400)))
        grid.add(points[-1], values[-1])
    grid.trim()
    expected = by_numpy(np.hstack(points), np.hstack(values), 0.25, grid.anchor)
    visited = np.argwhere(grid.counts) + grid.first
    assert {tuple(index) for index in visited.tolist()} == set(expected)
    assert grid.counts.sum() == 2400
    for index, (number, total, most, least) in expected.items():
        at = tuple(np.array(index) - grid.first)
        assert grid.counts[at] == number
        np.testing.assert_allclose(grid.sums[(..., *at)], total, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(grid.most[(..., *at)], most)
        np.testing.assert_array_equal(grid.least[(..., *at)], least)


def test_the_box_is_trimmed_to_visited_cells() -> None:
    grid = CellGrid(1.0, np.zeros(3), 0, "test")
    grid.add(np.array([[0.0, 9.0], [0.0, 0.0], [0.0, -3.0]]), np.zeros((0, 2)))
    grid.add(np.array([[-4.0], [0.0], [0.0]]), np.zeros((0, 1)))
    grid.trim()
    assert grid.counts.shape == (14, 1, 4) and grid.first.tolist() == [-4, 0, -3]
    grid.add(np.zeros((3, 0)), np.zeros((0, 0)))
    assert grid.counts.sum() == 3


def test_too_many_cells_are_an_error() -> None:
    grid = CellGrid(1e-3, np.zeros(3), 1, "workspace of robot 'r'")
    with pytest.raises(InputError, match=r"cells of 0.001 m give a box of 2001 x 2001 x 2001 cells.*larger"):
        grid.add(np.array([[-1.0, 1.0]] * 3), np.zeros((1, 2)))
