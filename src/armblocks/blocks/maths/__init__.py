"""Blocks that calculate outputs from inputs of the same time."""
