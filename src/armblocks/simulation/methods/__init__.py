"""The integrators as data, a file for each kind. Every table in a file of this folder is a solver."""
