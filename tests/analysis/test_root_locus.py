"""Root loci compared with the roots of the closed-loop polynomial."""

from __future__ import annotations

import numpy as np
import pytest

from armblocks.analysis.frequency import gain_and_phase
from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.root_locus import root_locus
from armblocks.errors import InputError


def chain() -> LinearSystem:
    """The system 1 / (s (s + 1) (s + 2))."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -2.0, -3.0]])
    return LinearSystem(A, [[0.0], [0.0], [1.0]], [[1.0, 0.0, 0.0]], [[0.0]])  # type: ignore[arg-type]


def test_roots_are_those_of_the_closed_loop_polynomial() -> None:
    locus = root_locus(chain())
    assert locus.gains[0] == 0.0
    for gain, roots in zip(locus.gains[::40], locus.roots[::40]):
        for root in roots:
            value = root * (root + 1.0) * (root + 2.0) + gain
            assert abs(value) < 1e-9 * max(1.0, abs(root) ** 3)


def test_branches_are_followed_without_jumps() -> None:
    locus = root_locus(chain())
    visible = np.abs(locus.roots) < 4.0
    steps = np.abs(np.diff(locus.roots, axis=0)) * visible[1:]
    # Two branches meet at -0.42 and leave at right angles: the roots move fast only there.
    assert steps.max() < 0.2
    crossing = np.argmax(locus.roots.real.max(axis=1) > 0.0)
    assert locus.gains[crossing - 1] <= 6.0 <= locus.gains[crossing]  # Routh: gain 6 at sqrt(2) rad/s


def test_the_caller_may_give_the_gains() -> None:
    locus = root_locus(chain(), np.array([0.0, 6.0]))
    assert np.abs(locus.roots[1]).min() == pytest.approx(np.sqrt(2.0), rel=1e-9)


def test_a_locus_of_several_channels_is_refused() -> None:
    with pytest.raises(InputError, match="a root locus of 2 inputs, 2 outputs and 1 state is requested"):
        root_locus(LinearSystem(-np.eye(1), np.ones((1, 2)), np.ones((2, 1)), np.zeros((2, 2))))


def test_phase_is_continuous_and_starts_at_minus_90_for_an_integrator() -> None:
    w = np.geomspace(1e-3, 1e3, 400)
    _, phase = gain_and_phase(chain(), w)
    expected = -90.0 - np.degrees(np.arctan(w)) - np.degrees(np.arctan(w / 2.0))
    assert np.allclose(phase[:, 0, 0], expected, atol=1e-9)


def test_the_phase_falls_by_180_degrees_at_an_undamped_pole() -> None:
    A = np.array([[0.0, 1.0], [-4.0, 0.0]])
    system = LinearSystem(A, [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])  # type: ignore[arg-type]
    _, phase = gain_and_phase(system, np.array([0.1, 1.0, 1.99, 2.01, 10.0]))
    assert np.allclose(phase[:, 0, 0], [0.0, 0.0, 0.0, -180.0, -180.0], atol=1e-9)
