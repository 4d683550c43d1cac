"""Blocks that make signals: constants, functions of time, sequences, noise, tables."""
