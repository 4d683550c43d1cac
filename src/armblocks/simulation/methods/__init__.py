"""The integrators as data, one file for each family. Every tableau in a file of this folder is a solver."""
