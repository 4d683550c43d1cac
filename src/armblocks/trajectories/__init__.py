"""Joint trajectories, for numbers and for symbols."""

from armblocks.trajectories.quintic import Motion, Quintic

__all__ = ["Motion", "Quintic"]
