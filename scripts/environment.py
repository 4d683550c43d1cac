"""Creates and updates ``.venv``, the virtual environment of the project.

This module uses the standard library only, so that ``python3 scripts/…`` needs no preparation on Linux, macOS
and Windows.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
BINARIES = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BINARIES / ("python.exe" if os.name == "nt" else "python")
STAMP = VENV / "armblocks-installed.json"
MIN_PYTHON = (3, 11)
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""The environment of commands. Bytecode is allowed, because processes start three times as fast with it."""


def print_line(text: str) -> None:
    """Print and flush, so that redirected output has the order of the commands."""
    print(text, flush=True)


def run(*command: str | Path, cwd: Path = ROOT) -> int:
    """Run a command without standard input; return its exit code. The output is not captured."""
    completed = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=ENVIRONMENT, stdin=subprocess.DEVNULL
    )
    return completed.returncode


def prepare(*extras: str) -> None:
    """Install armblocks (editable) with these extras of pyproject.toml into ``.venv``.

    A file in ``.venv`` records the installed extras. They are installed again if pyproject.toml changes.
    Exits with a message if Python is too old or a step fails.
    """
    if sys.version_info < MIN_PYTHON:
        minimum = ".".join(str(part) for part in MIN_PYTHON)
        sys.exit(f"armblocks needs Python {minimum} or newer; this is {sys.version.split()[0]}")
    if not _interpreter_works():
        _create()
    digest = _digest()
    installed = _read_stamp(digest)
    if installed is not None and set(extras) <= installed:
        return
    all_extras = sorted(set(extras) | (installed or set()))
    target = f".[{','.join(all_extras)}]" if all_extras else "."
    print_line(f"== install armblocks {target} (a minute or more the first time)")
    code = _pip_install("--editable", target)
    if code != 0:
        sys.exit(f"pip could not install armblocks (exit code {code}); see its message above")
    STAMP.write_text(json.dumps({"digest": digest, "extras": all_extras}), encoding="utf-8")


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


def prepare_browser() -> None:
    """Find a browser for the tests of the studio; install one on Debian and Ubuntu if there is none.

    Exits with a message without a browser, so that these tests are not skipped silently.
    """
    if any(shutil.which(name) for name in BROWSERS):
        return
    if shutil.which("apt-get") and hasattr(os, "geteuid"):
        sudo = [] if os.geteuid() == 0 else ["sudo", "-n"]
        apt = [*sudo, "apt-get", "-q", "-y", "-o", "DPkg::Lock::Timeout=500"]
        print_line("== install chromium")
        if run(*apt, "update") == 0 and run(*apt, "install", "--no-install-recommends", "chromium") == 0:
            return
    sys.exit(f"the tests of the studio need a browser: install one of {', '.join(BROWSERS)}")


def _interpreter_works() -> bool:
    """Whether the environment exists and its interpreter works (the system may have upgraded Python)."""
    if not PYTHON.exists():
        return False
    command = [str(PYTHON), "-c", "import pip"]
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True).returncode == 0


def _create() -> None:
    print_line(f"== create {VENV.name} with Python {sys.version.split()[0]}")
    if run(sys.executable, "-m", "venv", "--clear", VENV) != 0:
        sys.exit(
            f"Python could not create a virtual environment in {VENV}. "
            "On Debian and Ubuntu install its module: apt-get install python3-venv"
        )


PIP_STEPS = ("Downloading", "Using cached", "Installing collected packages")
"""First words of the lines in which pip reports its progress."""


def _pip_install(*arguments: str) -> int:
    """Run pip and show each of its steps with its start time; return the exit code."""
    # Bytecode for all modules would take longer than the installation. Imports create it when needed.
    command = [
        str(PYTHON),
        "-m",
        "pip",
        "install",
        "--no-input",
        "--no-compile",
        "--progress-bar",
        "off",
        *arguments,
    ]
    start = time.monotonic()
    with subprocess.Popen(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        errors="replace",
    ) as pip:
        assert pip.stdout is not None
        for line in pip.stdout:
            step = line.strip()
            if step.startswith(PIP_STEPS):
                print_line(f"   {time.monotonic() - start:4.0f} s  {step.partition(':')[0]}")
    return pip.returncode


def _digest() -> str:
    """A hash that changes with the dependencies in pyproject.toml and with the path of the checkout."""
    import tomllib  # imported here, so that an older Python reaches the message about its version

    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = pyproject["project"]
    relevant = [
        pyproject["build-system"],
        project["name"],
        project["version"],
        project["dependencies"],
        project.get("optional-dependencies"),
        project.get("scripts"),
        str(ROOT),
    ]
    return hashlib.sha256(json.dumps(relevant, sort_keys=True).encode()).hexdigest()


def _read_stamp(digest: str) -> set[str] | None:
    try:
        stamp = json.loads(STAMP.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return set(stamp["extras"]) if stamp.get("digest") == digest else None
