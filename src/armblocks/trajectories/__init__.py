"""Joint trajectories: a quintic for numbers and symbols, and piecewise polynomials of numbers."""

from armblocks.trajectories.piecewise import PiecewisePolynomial
from armblocks.trajectories.quintic import Motion, Quintic

__all__ = ["Motion", "PiecewisePolynomial", "Quintic"]
