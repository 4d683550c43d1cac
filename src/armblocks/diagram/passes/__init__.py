"""Passes: steps from a hierarchy of diagrams to a flat diagram, one in each file; see ``order``."""
