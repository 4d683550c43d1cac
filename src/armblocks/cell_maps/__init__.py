"""Samples counted in the cells of a regular grid in space, with statistics of their values."""
