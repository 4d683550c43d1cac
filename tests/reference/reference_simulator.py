"""Executable semantics of a diagram: a slow reference for the native simulator.

The simulator shares with the package the equations of single blocks (``Block.outputs``, ``derivatives``,
``mode_values``, ``resets`` …), the flattening of hierarchies and the inference of shapes. The simulator does
not use ``trace_diagram``, ``HybridSystem`` or the compiler.

**Signals.** At a time t, with the continuous states x and the discrete states z, every output is evaluated
once all inputs that it depends on are known. Outputs that depend on each other form an algebraic loop, which
Newton's method solves. A sampled block's output is held between the ticks of its clock.

**Modes.** A mode is a function of the signals: ``mode_values`` (for a condition: whether its quantity is
positive) at *every* evaluation, also inside a Runge-Kutta step. Only where that function reads the mode
itself (a relay's hysteresis) does the mode have a memory: the value before the instant, or before the latest
event at it. Where modes and signals depend on each other, both are evaluated again until no mode changes.

**Flow.** Between instants x follows the classical Runge-Kutta method with steps of at most ``step``. Within a
step the modes are those of its start. A step is accepted under three conditions: the signals give the same
modes at all stages, no guard changes its sign, and no delayed jump arrives. Otherwise bisection finds the
shortest step that is not accepted, to 1e-14; its end is an instant.

**Instant.** An instant is t = 0, a tick, a breakpoint (a time at which a source jumps), a recorded time, or
the time of an event. At an instant, in this order:

1. left limits: values "just before" the instant, such as the held output of a subsystem that is disabled,
   are evaluated with the old modes and states;
2. if a clock ticks, for each level of ticks: the events before this level; the outputs of this level are
   evaluated with the other signals, from the previous discrete states; then the discrete states of this
   level are updated together. Level 0 follows the events on which no sampled signal acts;
3. mode iteration: modes are made consistent with the signals; guards whose sign has changed fire, and
   ``resets`` gives new states; controls of conditional subsystems act. This is repeated until nothing
   changes;
4. the instant is recorded: signals are right-continuous.

**Conditional subsystems.** While a subsystem is disabled, the states of its blocks are constant and no guard
fires; its outputs keep their last value, or return to ``initial``. A restart sets all inner states to their
start values. A trigger executes the inner blocks once, like a tick.

Unsupported diagrams raise ``UnsupportedError``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
from reference_block import UnsupportedError
from reference_network import Network

from armblocks.diagram import Diagram

__all__ = ["EndlessEventsError", "Network", "ReferenceRun", "UnsupportedError", "run_reference"]

MAX_ITERATIONS = 100
RIGHT_LIMIT = 1e-12
"""Offset of the first stage of a step, s; its error is this time multiplied by the derivative."""
ALMOST_ZERO = 1e-9
"""Bound of a quantity that passes through zero at the end of a located step."""
SAME_TIME = 2.0**-50
"""Times within this relative distance belong to the same instant."""


class EndlessEventsError(Exception):
    """An instant whose mode iteration does not converge, or too many events in a run."""


class ReferenceRun:
    """One run of a diagram from 0 to ``stop``; ``record`` (N,) has the times to record, the first is 0.

    ``momentary``: whether a condition such as u ~= 0 has the value for u = 0 for a moment where u passes
    through 0. Otherwise it has this value only if u is exactly 0 at the end of a step, after rounding.
    ``seconds``: the processor time after which a run raises ``UnsupportedError``.
    """

    def __init__(
        self,
        diagram: Diagram,
        record: np.ndarray,
        step: float = 0.01,
        max_events: int = 500,
        momentary: bool = False,
        seconds: float = math.inf,
    ) -> None:
        self.momentary = momentary
        self.seconds, self.begin = seconds, time.process_time()
        self.network = network = Network(diagram)
        self.step = min([step, *network.shortest_delays()])
        self.stop = float(record[-1])
        self.record = record
        self.max_events = max_events
        self.events = 0
        self.event_time = 0.0
        self.max_step = self.step
        self.t = 0.0
        self.rows: list[dict[str, np.ndarray]] = []
        self.stopped = False

    def run(self) -> dict[str, np.ndarray]:
        """Return signals ``(N, *shape)`` by ``block/port``; fewer rows if a block ended the run."""
        network = self.network
        for t, clocks, recorded, jumps in self.instants():
            if t > 0.0:
                while not self.stopped and self.t < t:
                    if time.process_time() - self.begin > self.seconds:
                        raise UnsupportedError(f"the reference is too slow at {self.t} s")
                    self.flow(t, jumps)
                if self.stopped:
                    break
            self.instant(t, clocks)
            if recorded:
                self.rows.append(network.signals())
            if self.stopped:
                break
        return {name: np.array([row[name] for row in self.rows]) for name in self.rows[0]}

    # -- time ----------------------------------------------------------------------------------------------

    def instants(self) -> list[tuple[float, list[int], bool, bool]]:
        """Return all times known in advance, their clocks, and whether to record or a source jumps."""
        marks: list[tuple[float, str, int]] = [(float(t), "record", 0) for t in self.record]
        for number, (period, offset) in enumerate(self.network.clocks):
            count = int((self.stop - offset) / period) + 2
            marks += [(offset + k * period, "tick", number) for k in range(count)]
        marks += [(t, "jump", 0) for t in self.network.breakpoints() if t > 0.0]
        merged: list[tuple[float, list[int], bool, bool]] = []
        for t, event, number in sorted(marks):
            if t > self.stop * (1.0 + SAME_TIME):
                break
            if not merged or t > merged[-1][0] * (1.0 + SAME_TIME) + 1e-300:
                merged.append((t, [], False, False))
            time, clocks, recorded, jumps = merged[-1]
            clocks = [*clocks, number] if event == "tick" else clocks
            # The latest time of an instant is used for a jump, so that the source has already jumped.
            time = max(time, t) if event == "jump" else time
            merged[-1] = (time, clocks, recorded or event == "record", jumps or event == "jump")
        return merged

    # -- flow ----------------------------------------------------------------------------------------------

    def flow(self, end: float, jumps: bool) -> None:
        """Take one accepted step towards ``end``, and process the event after it, if there is one."""
        network = self.network
        latest = float(np.nextafter(end, 0.0)) if jumps else np.inf
        x = network.x.copy()
        h = end - self.t
        h = h if h < 1.5 * self.max_step else self.max_step
        self.max_step = min(self.step, 2.0 * self.max_step)
        modes_hold = self.stepped(x, h, latest)
        if not modes_hold:
            low, high = 0.0, h
            while (
                high - low > 1e-14 * max(1.0, self.t)
                and self.t + low < self.t + (low + high) / 2 < self.t + high
            ):
                if self.stepped(x, (low + high) / 2, latest, whole=False):
                    low = (low + high) / 2
                else:
                    high = (low + high) / 2
            h = high
            self.stepped(x, h, latest)
        if network.delays:
            network.record_delays(self.thirds(x, h), self.t, h)
        target = end if h >= end - self.t else self.t + h
        self.t = target
        if modes_hold:
            network.evaluate(min(self.t, latest), frozen=True, flowing=True)
            network.take_signs()
            return
        # Intervals between bounces may decrease: no step may cross a bounce.
        self.max_step = min(self.step, max(1e-9, (self.t - self.event_time) / 16))
        self.event_time = self.t
        self.events += 1
        if self.events > self.max_events:
            raise EndlessEventsError(f"more than {self.max_events} events at {self.t}")
        if self.t < end:
            self.instant(self.t, [])

    def stepped(self, start: np.ndarray, h: float, latest: float, whole: bool = True) -> bool:
        """Take one Runge-Kutta step with the modes of its start; return whether they hold at all stages.

        Unless the ``whole`` step is needed, it ends at the first stage with inconsistent modes.
        """
        network, t = self.network, self.t
        modes_hold = True

        def rate(offset: float, change: np.ndarray | float) -> np.ndarray:
            nonlocal modes_hold
            network.x[:] = start + change
            derivative = network.derivative(min(t + offset, latest))
            modes_hold = modes_hold and (offset == 0.0 or not network.modes_differ())
            return derivative

        # The right limit: a signal may differ at the instant itself, as the height does at a bounce.
        a = rate(0.0, min(h, RIGHT_LIMIT) * rate(0.0, 0.0))
        b = rate(h / 2, h / 2 * a)
        if not (modes_hold or whole):
            return False
        c = rate(h / 2, h / 2 * b)
        d = rate(h, h * c)
        if not (modes_hold or whole):
            return False
        network.x[:] = start + h / 6 * (a + 2 * b + 2 * c + d)
        self.end_derivatives = a, d
        network.evaluate(min(t + h, latest), frozen=True, flowing=True)
        return modes_hold and not network.modes_differ() and not network.fired()

    def thirds(self, start: np.ndarray, h: float) -> dict[float, np.ndarray]:
        """Return the states at 0, 1/3, 2/3 and 1 of the last step by cubic Hermite interpolation."""
        end = self.network.x.copy()
        a, d = self.end_derivatives
        states: dict[float, np.ndarray] = {}
        for s in (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0):
            cubic = (1 + 2 * s) * (1 - s) ** 2 * start + s * s * (3 - 2 * s) * end
            states[s] = cubic + h * s * (1 - s) * ((1 - s) * a - s * d)
        return states

    # -- instants ------------------------------------------------------------------------------------------

    def instant(self, t: float, clocks: list[int]) -> None:
        """Process one instant: left limits, ticks, and the mode iteration."""
        network = self.network
        if t > 0.0:
            network.capture(t)
        self.t = t
        if clocks:
            for level, last_rank in enumerate(network.instant_order.ranks_before_level):
                if t > 0.0:
                    self.iterate(t, last_rank)
                elif last_rank >= 0:
                    self.start()
                network.tick(t, clocks, level)
        if t == 0.0:
            self.start()
            network.take_signs()
        if self.momentary and t > 0.0 and network.hold_zeros(ALMOST_ZERO):
            self.iterate(t)
            network.hold_zeros(0.0)
        self.iterate(t)
        network.select_segments()
        network.end_instant()
        self.stopped = network.ended()

    def start(self) -> None:
        """Make the states consistent with the signals by resets without events: guards have no sign yet."""
        for _ in range(MAX_ITERATIONS):
            if not self.network.iterate(0.0, first=True):
                break

    def iterate(self, t: float, last_rank: float = math.inf) -> None:
        """Repeat the iteration of an instant until nothing changes; with a ``last_rank``, only for events up
        to this rank."""
        for _ in range(MAX_ITERATIONS):
            if not self.network.iterate(t, last_rank=last_rank) and not (
                last_rank == math.inf and self.network.settle()
            ):
                return
        raise EndlessEventsError(f"the events at {t} do not end")


def run_reference(
    diagram: Diagram,
    record: Sequence[float],
    step: float = 0.01,
    max_events: int = 500,
    *,
    momentary: bool = False,
    seconds: float = math.inf,
) -> dict[str, np.ndarray]:
    """Return signals ``(N, *shape)`` by ``block/port`` at the times ``record`` (N,), which start at 0."""
    times = np.asarray(record, dtype=np.float64)
    return ReferenceRun(diagram, times, step, max_events, momentary, seconds).run()
