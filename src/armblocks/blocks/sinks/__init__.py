"""Blocks that display or store signals, or end a run."""
