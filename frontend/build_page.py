"""Build the front end of the studio into the package: ``python3 frontend/build_page.py``.

Nothing is done if the build is up to date; a file with a hash records its sources. Standard library only.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import time
from pathlib import Path

from node import npm_command
from notices import write_notices

FRONTEND = Path(__file__).resolve().parent
ROOT = FRONTEND.parent
PAGE_FOLDER = ROOT / "src" / "armblocks" / "studio" / "web"
SOURCES_HASH_FILE = PAGE_FOLDER / ".built-from"
SOURCES = (
    "src",
    "public",
    "licences",
    "notices.py",
    "bundled_packages.ts",
    "index.html",
    "package.json",
    "package-lock.json",
    "tsconfig.json",
    "vite.config.ts",
    "vite.notebook.config.ts",
)


def is_outdated() -> bool:
    """Whether the build is missing or outdated, and its sources are present."""
    return not SOURCES_HASH_FILE.is_file() or SOURCES_HASH_FILE.read_text(encoding="utf-8") != digest()


def digest() -> str:
    """A hash of all sources of the front end."""
    hasher = hashlib.sha256()
    for name in SOURCES:
        top = FRONTEND / name
        for path in sorted(top.rglob("*")) if top.is_dir() else [top]:
            if path.is_file():
                hasher.update(
                    path.relative_to(FRONTEND).as_posix().encode() + b"\0" + path.read_bytes() + b"\0"
                )
    return hasher.hexdigest()


def build() -> None:
    """Install the libraries of the lock file if they are missing or outdated, and build the front end."""
    npm = npm_command()
    lock, installed = FRONTEND / "package-lock.json", FRONTEND / "node_modules" / ".armblocks-lock"
    lock_digest = hashlib.sha256(lock.read_bytes()).hexdigest()
    if not installed.is_file() or installed.read_text(encoding="utf-8") != lock_digest:
        _call("download the libraries of the front end", [*npm, "ci", "--no-audit", "--no-fund"])
        installed.write_text(lock_digest, encoding="utf-8")
    sources_digest = digest()  # sources that are changed during the build are built next time
    _call("build the front end", [*npm, "run", "build"])
    write_notices(PAGE_FOLDER)
    SOURCES_HASH_FILE.write_text(sources_digest, encoding="utf-8")


def _call(title: str, command: list[str]) -> None:
    """Run a step; its title goes to standard error, its output only if it fails."""
    start = time.monotonic()
    print(f"   {title} …", end="", flush=True, file=sys.stderr)
    completed = subprocess.run(
        command,
        cwd=FRONTEND,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
    )
    print(f" {time.monotonic() - start:.0f} s", flush=True, file=sys.stderr)
    if completed.returncode != 0:
        sys.stderr.write(completed.stdout + completed.stderr)
        raise SystemExit(
            "The front end of the studio could not be built; the reason is printed above.\n"
            "To install armblocks without the front end: ARMBLOCKS_SKIP_WEB=1 pip install .\n"
            "With Node.js 20.19 or newer and access to the npm registry, build it with\n"
            f"python3 {FRONTEND / 'build_page.py'}"
        )


def main() -> None:
    """Build the front end if it is missing or outdated."""
    if is_outdated():
        build()


if __name__ == "__main__":
    main()
