"""Write the pictures of README and docs/paper.md into docs/pictures, from the experiment of the paper.

Run ``python3 scripts/pictures.py`` and commit the changed files.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from environment import PYTHON, ROOT, prepare, run

PICTURES = ("figures/moments.svg", "figures/tool-path.svg", "figures/joints.svg", "diagram.svg")
TARGET = ROOT / "docs" / "pictures"


def main() -> int:
    """Run the experiment in a temporary folder and copy its pictures."""
    prepare()
    with tempfile.TemporaryDirectory() as folder:
        code = run(PYTHON, "-m", "armblocks", "run", "kr180model", "--out", folder)
        if code == 0:
            TARGET.mkdir(exist_ok=True)
            for picture in PICTURES:
                shutil.copyfile(Path(folder) / picture, TARGET / f"kr180-{Path(picture).name}")
    return code


if __name__ == "__main__":
    sys.exit(main())
