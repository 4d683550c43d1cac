"""Set up and run the main job: the paper's experiment, with a report of every picture and number.

The environment gets the core and the studio, whose page is built when ``armblocks studio`` is first started.

``python3 scripts/demo.py [armblocks run's own options]``, for instance ``--stop-time 5`` or ``--out DIR``.
"""

from __future__ import annotations

import sys

from environment import BINARIES, prepare, run


def main() -> int:
    """Run ``armblocks run kr180model`` in the project's environment; its exit code is this script's."""
    prepare("studio")
    return run(BINARIES / "armblocks", "run", "kr180model", *sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
