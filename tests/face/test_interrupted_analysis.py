"""Ctrl-C during an analysis: it ends with KeyboardInterrupt during every computation."""

from __future__ import annotations

import contextlib
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

import armblocks as ab
from armblocks import interrupts
from armblocks.simulation import Simulation
from interruptible import start_interruptible

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

SCRIPT = """
import signal, sys, time
import numpy as np
import armblocks as ab
from armblocks.blocks import Gain, Integrator

builder = ab.DiagramBuilder("oscillators")
for k in range(4):
    x = builder.add(f"x{k}", Integrator(initial=1.0))
    v = builder.add(f"v{k}", Integrator())
    builder.connect(v, x["u"])
    builder.connect(builder.add(f"g{k}", Gain(gain=-(3.0 + k) ** 2), x), v["u"])
diagram = ab.compile_diagram(builder.build())
calls = {
    "linearize": lambda: ab.linearize(diagram, "g0", "x0"),
    "linearize at a time": lambda: ab.linearize(diagram, "g0", "x0", at=100.0),
    "trim": lambda: ab.trim("falling_pendulum", guess={"pendulum/q": -1.2}),
    "frequency response": lambda: ab.frequency_response(diagram, "g0", "x0", np.logspace(-2, 2, 5000)),
}
interrupted = running = False

def note_and_raise(number, frame):
    global interrupted
    if running:
        interrupted = True
        signal.raise_signal(signal.SIGINT)

def run(call):
    global running
    running = True
    try:
        call()
    finally:
        running = False

signal.signal(signal.SIGALRM, note_and_raise)
for name, call in calls.items():
    call()
    start = time.perf_counter()
    call()
    duration = time.perf_counter() - start
    for part in range(1, 16):
        interrupted = False
        outcome = "ended"
        try:
            signal.setitimer(signal.ITIMER_REAL, duration * part / 20)
            run(call)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        except KeyboardInterrupt:
            outcome = "interrupted"
        except Exception as error:
            outcome = repr(error)
        if interrupted and outcome != "interrupted":
            print(name, part, outcome)
print("done")
"""


def test_ctrl_c_is_never_discarded(tmp_path: Path) -> None:
    script = tmp_path / "analysis.py"
    script.write_text(SCRIPT)
    process = start_interruptible([sys.executable, "-W", "ignore", str(script)], stdout=-1, stderr=-1)
    output, _ = process.communicate(timeout=300)
    assert output == "done\n"


def test_an_ignored_interrupt_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts.kept():
            signal.raise_signal(signal.SIGINT)
        interrupts.check()
    finally:
        signal.signal(signal.SIGINT, before)


def test_another_error_does_not_replace_an_interrupt() -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), interrupts.kept():
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt:
                raise ValueError("as a library does") from None
        with pytest.raises(KeyboardInterrupt), interrupts.kept(), contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


def test_ctrl_c_after_the_last_step_of_a_run_ends_the_analysis(monkeypatch: pytest.MonkeyPatch) -> None:
    advance = Simulation.advance

    def interrupted(run: Simulation, **limits: Any) -> None:
        advance(run, **limits)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Simulation, "advance", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert ab.simulate("falling_pendulum", stop_time=1.0).run.complete
        with pytest.raises(KeyboardInterrupt):
            ab.linearize("falling_pendulum", (), "pendulum/q", at=1.0)
    finally:
        signal.signal(signal.SIGINT, before)
