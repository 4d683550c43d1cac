"""Set up the environment and run every check, before a commit and in CI.

``python3 scripts/test.py`` runs all steps, also after a failure. The exit code is 1 if a step failed.
``python3 scripts/test.py format types`` runs only the named steps.

The static checks run two at a time, then the tests run. The checks of the front end need Node.js only and run
during the installation. The output has the order of the steps: the output of the first unfinished step is
shown immediately, that of later steps is buffered.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from threading import Event

from environment import BINARIES, ENVIRONMENT, PYTHON, ROOT, prepare, prepare_browser, print_line

sys.path.insert(0, str(ROOT / "frontend"))
from node import system_npm

SOURCES = ("src", "tests", "scripts", "docs", "benchmarks", "hatch_build.py", "frontend")
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
TEST_PROCESSES = CORES + (CORES + 1) // 2
"""More processes than cores: a browser test waits for its page during almost half of its time."""
WEB_PYTHON = sys.executable if system_npm() else PYTHON
"""The interpreter of the steps of the front end. Without Node.js on the system they use that of ``.venv``."""
WEB_TOOL = (WEB_PYTHON, "frontend/node.py", "exec", "--offline", "--")
WITHOUT_TERMINAL = "addopts=-p no:cacheprovider"
"""The options of pytest in pyproject.toml contain some of the plugin ``terminal``."""

STEPS: dict[str, tuple[str | object, ...]] = {
    "page": (WEB_PYTHON, "frontend/build_page.py"),
    "web types": (PYTHON, "scripts/studio_types.py", "--check"),
    "web lint": (*WEB_TOOL, "oxlint", "src", "tests"),
    "web format": (*WEB_TOOL, "prettier", "--check", "{src,tests}/**/*.{ts,tsx}", "*.ts"),
    "web tests": (*WEB_TOOL, "vitest", "run"),
    "lint": (BINARIES / "ruff", "check", *SOURCES),
    "format": (BINARIES / "ruff", "format", "--check", *SOURCES),
    "types": (BINARIES / "pyright", "--warnings"),
    "layers": (BINARIES / "lint-imports", "--no-cache"),
    "docs": (PYTHON, "docs/build_site.py"),
    "test files": (PYTHON, "-m", "pytest", "--collect-only", "-p", "no:terminal", "-o", WITHOUT_TERMINAL),
    "tests": (PYTHON, "-m", "pytest", f"-n{TEST_PROCESSES}", "--dist=loadfile", "--no-loadscope-reorder"),
}
NEEDED = {"web types": "page", "web lint": "page", "web format": "page", "web tests": "page"}
"""Steps that wait for another step: the page downloads the libraries that they use."""
STAGES = (
    (
        *("page", "web tests", "web format", "web lint", "docs", "types"),
        *("web types", "layers", "lint", "format", "test files"),
    ),
    ("tests",),
)
"""Stages run in sequence. The steps of a stage start in this order, two at a time: first those that can run
during the installation, then long steps first.
The tests have a separate stage: browser tests need all cores, and the wheel is built from page and docs.
The step "test files" imports all test files, so that the test processes find their bytecode: otherwise each
process would compile the same files. The tests report its errors."""
PARALLEL_STEPS = 2
"""Steps that run at the same time. The installation counts as one of them."""
LIBRARIES_WITH_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}
"""Each core has its own test process; threads of OpenBLAS that wait for each other take processor time."""
POLL_SECONDS = 0.1
"""Interval at which new output of a step is shown, s."""


class Step:
    """One command; its output is written to a file."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        self.command = [str(part) for part in STEPS[name]]
        self.code: int | None = None
        self.seconds = 0.0
        self._output = folder / f"{name}.txt"
        self._output.touch()
        self._ended = Event()
        self._process: subprocess.Popen[bytes] | None = None

    def run(self) -> None:
        """Run the command without standard input until it ends."""
        start = time.perf_counter()
        try:
            with self._output.open("wb") as output:
                self._process = subprocess.Popen(
                    self.command,
                    cwd=ROOT,
                    env={**LIBRARIES_WITH_ONE_THREAD, **ENVIRONMENT},
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                )
                self.code = self._process.wait()
        except OSError as error:
            self._output.write_text(f"{error}\n", encoding="utf-8")
            self.code = 127
        finally:
            self.seconds = time.perf_counter() - start
            self._ended.set()

    def wait(self) -> None:
        """Wait until the command has ended."""
        self._ended.wait()

    def follow(self) -> None:
        """Show the existing output, and new output until the command ends."""
        print_line(f"== {self.name}: {' '.join(self.command).replace(f'{ROOT}/', '')}")
        with self._output.open("rb") as output:
            while True:
                ended = self._ended.wait(POLL_SECONDS)
                if text := output.read():
                    sys.stdout.buffer.write(text)
                    sys.stdout.buffer.flush()
                if ended:
                    return

    def end(self) -> None:
        """Stop the command if it is running; steps that wait for it do not start."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
        self._ended.set()


def run_steps(names: Sequence[str], browser: Future[None]) -> list[Step]:
    """Install armblocks, run these steps, each once, and show their output in the order of ``STEPS``.

    ``browser`` is the preparation of the browser. Exits with a message if it or the installation fails.
    """
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(PARALLEL_STEPS) as pool:
        steps = {name: Step(name, Path(folder)) for name in names}
        stopped = Event()
        environment = pool.submit(prepare, "test")

        def run_step(name: str) -> None:
            # What a step waits for has started before: it precedes the step in the pool.
            if (needed := steps.get(NEEDED.get(name, ""))) is not None:
                needed.wait()
            uses_environment = steps[name].command[0].startswith(str(BINARIES))
            if uses_environment and environment.exception() is not None:
                return
            if not stopped.is_set():
                steps[name].run()

        try:
            for stage in STAGES:
                running: list[Future[None]] = [pool.submit(run_step, name) for name in stage if name in steps]
                environment.result()
                browser.result()
                for name in names:
                    if name in stage:
                        steps[name].follow()
                for future in running:
                    future.result()
        except BaseException:
            stopped.set()
            for step in steps.values():
                step.end()
            raise
        return list(steps.values())


def main() -> int:
    """Run the requested steps; return 0 if all passed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "steps", nargs="*", metavar="step", help=f"steps to run: {', '.join(STEPS)} (default: all)"
    )
    requested = parser.parse_args().steps
    for name in requested:
        if name not in STEPS:
            parser.error(f"there is no step named '{name}'; the steps are {', '.join(STEPS)}")
    start = time.perf_counter()
    with ThreadPoolExecutor() as pool:
        browser = pool.submit(prepare_browser)
        results = run_steps([name for name in STEPS if not requested or name in requested], browser)
    print_line("== summary")
    for step in results:
        verdict = "passed" if step.code == 0 else f"FAILED (exit code {step.code})"
        print_line(f"   {step.name:<10} {verdict:<24} {step.seconds:6.1f} s")
    print_line(f"   total with installation {time.perf_counter() - start:20.1f} s")
    return 1 if any(step.code != 0 for step in results) else 0


if __name__ == "__main__":
    sys.exit(main())
