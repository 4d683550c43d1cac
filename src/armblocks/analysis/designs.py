"""Random and quasi-random points in the unit cube, and quantiles, with SciPy."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import UnknownNameError
from armblocks.extras import from_extra

Array = NDArray[np.float64]

RANDOM, SOBOL, HALTON, LATIN = DESIGNS = ("random", "sobol", "halton", "latin")
"""The names of the designs."""


def unit_points(design: str, count: int, dimensions: int, seed: int) -> Array:
    """``count`` points in the unit cube, ``(count, dimensions)``, each coordinate above 0 and below 1.

    ``random``: independent points of NumPy's generator PCG64. ``sobol``, ``halton``: scrambled sequences that
    fill the cube evenly. ``latin``: a Latin hypercube, with one point in each of ``count`` slices of each
    coordinate. The points depend on the ``seed`` and on the versions of NumPy and SciPy.

    Source: ``scipy.stats.qmc``. Raises ``UnknownNameError`` for an unknown design.
    """
    if design not in DESIGNS:
        raise UnknownNameError("design", design, DESIGNS, where="sweep")
    if not dimensions:
        return np.empty((count, 0))
    if design == RANDOM:
        points = np.random.default_rng(seed).random((count, dimensions))
    else:
        with from_extra("analysis", "quasi-random designs"):
            from scipy.stats import qmc

        kinds: Mapping[str, Any] = {SOBOL: qmc.Sobol, HALTON: qmc.Halton, LATIN: qmc.LatinHypercube}
        generator = np.random.default_rng(seed)
        # SciPy 1.15 renamed the argument.
        name = "rng" if "rng" in inspect.signature(kinds[design]).parameters else "seed"
        sampler = kinds[design](dimensions, **{name: generator})
        if design == SOBOL:
            # A Sobol sequence is balanced for powers of two; SciPy warns about other numbers.
            points = sampler.random_base2(max(0, count - 1).bit_length())[:count]
        else:
            points = sampler.random(count)
    # The quantiles of 0 and 1 may be infinite.
    return np.clip(np.asarray(points, dtype=np.float64), 2.0**-53, 1.0 - 2.0**-53)


def normal_quantile(probability: Array) -> Array:
    """The quantile of the standard normal distribution."""
    with from_extra("analysis", "normal distributions"):
        from scipy.special import ndtri

    return np.asarray(ndtri(probability), dtype=np.float64)
