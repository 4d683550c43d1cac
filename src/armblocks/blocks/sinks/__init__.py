"""Blocks that show or store signals, or end a run."""
