"""Motions along a given path in the least time."""
