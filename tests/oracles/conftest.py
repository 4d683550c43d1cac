"""Selects the reference implementations that are available on this system."""

import sys

# Pinocchio has no wheel for Windows, where only MuJoCo checks the dynamics.
collect_ignore = ["test_pinocchio.py"] if sys.platform == "win32" else []
