"""Estimation of parameters from measurements: least squares with standard errors, filters, constraints.

All arguments and results are arrays; the package does not use robots or diagrams.
"""
