"""Blocks that generate signals: constants, functions of time, sequences, noise, tables."""
