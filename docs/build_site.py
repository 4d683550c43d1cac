"""Build the documentation into ``docs/_build/html``: ``python3 docs/build_site.py``.

Pages whose sources have not changed since the last build are not built again; a file with a hash records the
sources. Wheels of armblocks contain the pages, and ``armblocks docs`` opens them. Sphinx and its theme are in
the extra ``docs``.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
SITE = DOCS / "_build" / "html"
STAMP = DOCS / "_build" / "built-from"
SOURCES = ("docs", "src/armblocks", "robots", "examples", "libraries")
"""Sources of the pages, including the code whose blocks, robots, examples and docstrings they show."""
GENERATED = ("docs/_build", "docs/reference", "src/armblocks/studio/web")
"""Folders with generated files."""
UNUSED_FILES = ("debug.css", "file.png", "plus.png", "minus.png", "skeleton.css")
"""Files of the theme that no page uses."""


def needed() -> bool:
    """Whether the pages are missing or outdated."""
    exists = STAMP.is_file() and (SITE / "index.html").is_file()
    return not exists or STAMP.read_text(encoding="utf-8") != digest()


def digest() -> str:
    """A hash of all sources of the pages."""
    sources_hash = hashlib.sha256()
    for path in _sources():
        sources_hash.update(
            path.relative_to(ROOT).as_posix().encode()
            + b"\0"
            + path.read_bytes()
            + b"\0"
        )
    return sources_hash.hexdigest()


def _sources() -> Iterator[Path]:
    generated = [ROOT / name for name in GENERATED]
    for name in SOURCES:
        for path in sorted((ROOT / name).rglob("*")):
            is_generated = any(path.is_relative_to(folder) for folder in generated)
            # Checks of the code write caches, whose names are __pycache__ or begin with a dot.
            parts = path.relative_to(ROOT).parts
            is_cached = any(part.startswith((".", "__pycache__")) for part in parts)
            if path.is_file() and not is_generated and not is_cached:
                yield path


def build() -> None:
    """Build the pages with warnings as errors. Raises ``SystemExit`` with the reason if the build fails."""
    print("   build the documentation (about a minute)", flush=True, file=sys.stderr)
    STAMP.unlink(missing_ok=True)
    shutil.rmtree(
        SITE, ignore_errors=True
    )  # Sphinx does not remove the pages of removed documents
    before = digest()
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    # In a build of a wheel, armblocks itself is not installed.
    paths = [str(ROOT / "src"), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(path for path in paths if path),
    }
    # A new folder for intermediate data: data of an earlier build may come from another version of the code.
    with tempfile.TemporaryDirectory() as doctrees:
        command += ["-d", doctrees, str(DOCS), str(SITE)]
        completed = subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr,
        )
    if completed.returncode != 0:
        raise SystemExit(
            "The documentation could not be built; the reason is printed above.\n"
            "To install armblocks without the documentation: ARMBLOCKS_SKIP_DOCS=1 pip install .\n"
            f"To install the tools for the documentation: pip install --editable '{ROOT}[docs]'"
        )
    for name in UNUSED_FILES:
        (SITE / "_static" / name).unlink(missing_ok=True)
    shutil.rmtree(SITE / "_sources", ignore_errors=True)
    STAMP.write_text(before, encoding="utf-8")


def main() -> None:
    """Build the pages if they are missing or outdated."""
    if needed():
        build()


if __name__ == "__main__":
    main()
