"""Laws of motion in joint space, for numbers and symbols alike."""

from armblocks.trajectories.quintic import Motion, Quintic

__all__ = ["Motion", "Quintic"]
