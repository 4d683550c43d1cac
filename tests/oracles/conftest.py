"""Which oracles there are on this system."""

import sys

# Pinocchio has no wheel for Windows; MuJoCo checks the dynamics there.
collect_ignore = ["test_pinocchio.py"] if sys.platform == "win32" else []
