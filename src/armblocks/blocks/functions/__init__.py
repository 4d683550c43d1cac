"""Blocks with user-written equations: expressions and Python functions."""
