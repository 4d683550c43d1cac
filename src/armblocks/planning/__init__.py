"""Time-optimal motions along a given path."""
