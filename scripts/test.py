"""Set up and run every check: what a person runs before a commit, and what CI runs.

``python3 scripts/test.py`` runs all steps, goes on after a failure so that one run tells all, and ends with
exit code 1 if any step failed. ``python3 scripts/test.py format types`` runs only the steps named.
"""

from __future__ import annotations

import argparse
import sys
import time

from environment import BINARIES, PYTHON, ROOT, prepare, prepare_browser, run, say

SOURCES = ("src", "tests", "scripts", "docs", "benchmarks", "hatch_build.py")

STEPS: dict[str, tuple[str | object, ...]] = {
    "page": (PYTHON, "hatch_build.py"),
    "web types": (PYTHON, "scripts/studio_types.py", "--check"),
    "lint": (BINARIES / "ruff", "check", *SOURCES),
    "format": (BINARIES / "ruff", "format", "--check", *SOURCES),
    "types": (BINARIES / "pyright", "--warnings"),
    "layers": (BINARIES / "lint-imports", "--no-cache"),
    "docs": (PYTHON, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs", "docs/_build/html"),
    "tests": (PYTHON, "-m", "pytest", "-n", "auto"),
}


def main() -> int:
    """Run the steps asked for, in order; 0 if all passed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "steps", nargs="*", metavar="step", help=f"which steps: {', '.join(STEPS)} (default: all)"
    )
    asked = parser.parse_args().steps
    for name in asked:
        if name not in STEPS:
            parser.error(f"there is no step named '{name}'; the steps are {', '.join(STEPS)}")
    prepare("test")
    prepare_browser()
    outcome: dict[str, tuple[int, float]] = {}
    for name, command in STEPS.items():
        if asked and name not in asked:
            continue
        shown = " ".join(str(part) for part in command).replace(f"{ROOT}/", "")
        say(f"== {name}: {shown}")
        start = time.perf_counter()
        code = run(*(str(part) for part in command))
        outcome[name] = (code, time.perf_counter() - start)
    say("== summary")
    for name, (code, seconds) in outcome.items():
        say(f"   {name:<8} {'passed' if code == 0 else f'FAILED (exit code {code})':<24} {seconds:6.1f} s")
    return 1 if any(code != 0 for code, _ in outcome.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
