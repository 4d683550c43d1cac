"""Estimation of parameters from measurements: least squares with standard errors, filters, constraints.

The package has arrays only: it knows neither robots nor diagrams.
"""
