"""Minimisation of functions with bounds and constraints: with derivatives, or with values alone."""
