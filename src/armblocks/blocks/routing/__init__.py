"""Blocks that combine, split, select and switch signals."""
