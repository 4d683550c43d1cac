"""Set up the environment and run the experiment of the paper, with a report of all figures and numbers.

The environment contains the core and the studio. The first start of ``armblocks studio`` builds its front
end.

``python3 scripts/demo.py [options of armblocks run]``, for example ``--stop-time 5`` or ``--out DIR``.
"""

from __future__ import annotations

import sys

from environment import BINARIES, prepare, run


def main() -> int:
    """Run ``armblocks run kr180model`` in the project's environment; return its exit code."""
    prepare("studio")
    return run(BINARIES / "armblocks", "run", "kr180model", *sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
