"""Blocks whose equation the user writes: expressions and Python functions."""
