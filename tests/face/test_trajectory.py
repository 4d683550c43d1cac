"""``jtraj`` as arrays."""

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import InputError


def test_jtraj_starts_and_ends_where_and_how_it_is_told() -> None:
    t = np.linspace(0, 4, 401)
    path = ab.jtraj([0, 1], [2, -1], t, qd0=[0.1, 0.0], qd1=[0.0, -0.2])
    assert len(path) == 401
    np.testing.assert_allclose(path.q[[0, -1]], [[0, 1], [2, -1]], atol=1e-15)
    np.testing.assert_allclose(path.qd[[0, -1]], [[0.1, 0.0], [0.0, -0.2]], atol=1e-15)
    np.testing.assert_allclose(path.qdd[[0, -1]], 0.0, atol=1e-14)
    np.testing.assert_allclose(np.gradient(path.q, t, axis=0)[1:-1], path.qd[1:-1], atol=2e-4)


def test_a_count_of_samples_means_normalised_time() -> None:
    path = ab.jtraj([0.0], [1.0], 5)
    np.testing.assert_array_equal(path.t, [0, 0.25, 0.5, 0.75, 1])
    s = path.t
    np.testing.assert_allclose(path.q[:, 0], 10 * s**3 - 15 * s**4 + 6 * s**5, atol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0, np.nan], [1, 1], 10), r"q0 = .*nan.*a vector of finite joint values"),
        (([0, 0], [1, 1, 1], 10), "qf has 3 joints.*Allowed: 2, as q0"),
        (([0], [1], 1), "t = 1 samples.*2 or more"),
        (([0], [1], [0.0, 0.0]), "rising finite instants that start at 0"),
        (([0], [1], [1.0, 2.0]), "rising finite instants that start at 0"),
    ],
)
def test_jtraj_refuses_in_words(arguments: tuple, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ab.jtraj(*arguments)
