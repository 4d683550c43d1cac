"""Tableaux of the solvers, one module for each family of methods.

Every tableau of these modules is a solver.
"""
