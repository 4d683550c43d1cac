"""The plan of a run, checked before its first step: integrator, sample times, tolerances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.equations import SimulationOptions
from armblocks.errors import InputError, UnknownNameError
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.methods.runge_kutta import EULER, RK4
from armblocks.simulation.tableaux import DEFAULT, STIFF, TABLEAUX, find_tableau

Array = NDArray[np.float64]

DEFAULT_INTERVALS = 1000
"""Number of recorded intervals if no sample time is given: for example 10 s in intervals of 10 ms."""
MAX_STEPS = 1e11
"""Maximum number of fixed steps, or of ticks of a clock, in a run."""
MAX_NUMBERS = 500_000_000
"""Maximum number of recorded doubles of one run in memory, 4 GB."""
MIN_RTOL = 1e-13
"""Minimum relative tolerance. Below it, rounding errors exceed the errors of the method."""


@dataclass(frozen=True, kw_only=True)
class LogRequest:
    """Request to write ``signals`` (all if empty) to ``path`` (``.parquet`` or ``.csv``) during a run."""

    path: Path
    signals: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SampleTimes:
    """The sample times of a run: ``start``, ``k sample_time`` for integers ``k`` in between, and ``stop``.

    Each time is computed as a product, so no error accumulates. A time within a billionth of a sample time of
    the stop time, or of a start other than 0, is replaced by that time. The times are computed in parts on
    request.
    """

    start: float
    stop: float
    sample_time: float
    first: int
    """``k`` of the first sample time after the start."""
    count: int

    @staticmethod
    def between(start: float, stop: float, sample_time: float) -> SampleTimes:
        """The sample times of a run."""
        last, first = math.ceil(stop / sample_time - 1e-9), 1
        if start > 0.0:
            first = max(0, math.floor(start / sample_time) - 1)
            while first < last and first * sample_time <= start + 1e-9 * sample_time:
                first += 1
        count = 1 if last == 0 else 1 + last - min(first, last) + 1
        return SampleTimes(start=start, stop=stop, sample_time=sample_time, first=first, count=count)

    def part(self, begin: int, end: int) -> Array:
        """Sample times number ``begin`` to ``end - 1``, s."""
        numbers = np.arange(begin, end, dtype=np.float64) + (self.first - 1.0)
        times: Array = numbers * self.sample_time
        if begin == 0 < end:
            times[0] = self.start
        if begin < end == self.count:
            times[-1] = self.stop
        return times

    def up_to(self, time: float) -> int:
        """Number of sample times up to and including a time (s)."""
        if time >= self.stop:
            return self.count
        number = max(0, math.floor(time / self.sample_time) - self.first)
        while number < self.count and self.part(number, number + 1)[0] <= time:
            number += 1
        return number


@dataclass(frozen=True, kw_only=True, eq=False)
class ListedTimes(SampleTimes):
    """Sample times at any distances: ``times`` (N,) s, ascending, from the start of the run."""

    times: Array

    @staticmethod
    def of(times: Array) -> ListedTimes:
        """The sample times of a run that ends at the last sample time."""
        start, stop = float(times[0]), float(times[-1])
        step = (stop - start) / DEFAULT_INTERVALS if stop > start else 1.0
        return ListedTimes(
            start=start, stop=stop, sample_time=step, first=1, count=len(times), times=np.array(times)
        )

    def part(self, begin: int, end: int) -> Array:
        """Sample times number ``begin`` to ``end - 1``, s."""
        return self.times[begin:end].copy()

    def up_to(self, time: float) -> int:
        """Number of sample times up to and including a time (s)."""
        return int(np.searchsorted(self.times, time, side="right"))


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The settings of one run, with all choices made.

    ``tableau`` is the method, ``None`` for a system without states. ``stiff`` is the method that replaces it
    if the system proves stiff, or ``None``.
    """

    tableau: Tableau | None
    stiff: Tableau | None
    solver: str
    reason: str
    sample_times: SampleTimes
    step: float
    max_step: float


def make_plan(
    system: CompiledSystem, options: SimulationOptions, start: float = 0.0, *, logged: bool = False
) -> Plan:
    """The plan of a run that begins at ``start``, with every open choice of ``options`` made.

    The number of samples of a run that is ``logged`` to a file is not limited. Raises ``InputError`` for
    invalid values.
    """
    check_options(options, system.name)
    stop, step = float(options.stop_time), options.step
    if start > 0.0 and stop <= start:
        raise InputError(
            f"stop_time is {stop:g} s, and the run continues from {start:g} s",
            where=system.name,
            allowed=f"a time after {start:g} s: stop_time counts from 0, not from the saved state",
            fix=f"for 1 s more, stop_time={start + 1.0:g}",
        )
    for period, _ in system.sizes.clocks:
        _check_step_count("the period of a sampled block", period, stop, system.name)
    tableau, reason = _choose_method(system, options)
    fixed_step = None if tableau is None or tableau.adaptive else step
    sample_time = _sample_time(system, options, stop, fixed_step, logged=logged)
    max_step = math.inf if options.max_step is None else float(options.max_step)
    solver = "none" if tableau is None or system.states.size == 0 else tableau.name
    return Plan(
        tableau=tableau,
        stiff=STIFF if tableau is DEFAULT and options.solver.casefold() == "auto" else None,
        solver=solver,
        reason=reason,
        sample_times=SampleTimes.between(start, stop, sample_time),
        step=step if step is not None else sample_time,
        max_step=max_step,
    )


def check_options(options: SimulationOptions, where: str) -> None:
    """Raise ``InputError`` for options that are invalid for every system.

    Only the name of the ``solver`` is checked; :func:`make_plan` checks whether it suits the system.
    """
    stop = _number("stop_time", options.stop_time, where, "a finite time in s, 0 or more", minimum=0.0)
    step = options.step
    if step is not None:
        step = _number("step", step, where, "a time in s above 0, at most the stop time", above=0.0)
        if stop > 0.0 and step > stop:
            raise InputError(
                f"step is {step:g} s",
                where=where,
                allowed=f"above 0, at most the stop time {stop:g} s",
                fix="choose a smaller step",
            )
        _check_resolution("step", step, stop, where)
        _check_step_count("step", step, stop, where)
    _check_solver(options.solver, where)
    if options.sample_time is not None:
        _number("sample_time", options.sample_time, where, "a time in s above 0", above=0.0)
    rtol = _finite(options.rtol)
    if rtol is None or not MIN_RTOL <= rtol <= 1.0:
        raise InputError(
            f"rtol is {options.rtol!r}",
            where=where,
            allowed=f"{MIN_RTOL:g} to 1: a double has 16 digits",
            fix="use 1e-6 at first, and 1e-10 for high accuracy",
        )
    _number("atol", options.atol, where, "a number above 0, in the units of the states", above=0.0)
    if not isinstance(options.record_jumps, bool):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(
            f"record_jumps is {options.record_jumps!r}",
            where=where,
            allowed="True or False",
            fix="choose one",
        )
    if options.max_step is not None:
        max_step = _number("max_step", options.max_step, where, "a time in s above 0", above=0.0)
        _check_resolution("max_step", max_step, stop, where)


def _check_solver(name: object, where: str) -> None:
    if not isinstance(name, str):
        raise InputError(f"solver is {name!r}", where=where, allowed="a name", fix="'auto' chooses one")
    if name.casefold() != "auto":
        find_tableau(name, where)


def _check_resolution(name: str, step: float, stop: float, where: str) -> None:
    """Raise ``InputError`` for a step below the resolution of times near the end of the run."""
    minimum = 4.0 * math.ulp(stop)
    if step < minimum:
        raise InputError(
            f"{name} is {step:g} s, and times near {stop:g} s are {math.ulp(stop):.2g} s apart",
            where=where,
            allowed=f"at least {minimum:.2g} s here",
            fix="choose a larger step, or count the time from another origin",
        )


def _check_step_count(name: str, step: float, stop: float, where: str) -> None:
    """Raise ``InputError`` for a step or period that occurs more than ``MAX_STEPS`` times in a run."""
    if stop > MAX_STEPS * step:
        raise InputError(
            f"{name} is {step:g} s, and the stop time {stop:g} s: {stop / step:.0e} steps",
            where=where,
            allowed=f"at most {MAX_STEPS:.0e}, which take hours",
            fix=f"check that {name} is in seconds, increase it, or choose an earlier stop time",
        )


def _finite(value: object) -> float | None:
    """The value as a float; ``None`` for Booleans, non-finite numbers and other types."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    number = float(value)
    return number if math.isfinite(number) else None


def _number(
    name: str, value: object, where: str, allowed: str, minimum: float = -math.inf, above: float = -math.inf
) -> float:
    number = _finite(value)
    if number is not None and number >= minimum and number > above:
        return number
    raise InputError(f"{name} is {value!r}", where=where, allowed=allowed, fix=f"give another {name}")


def _choose_method(system: CompiledSystem, options: SimulationOptions) -> tuple[Tableau | None, str]:
    automatic = options.solver.casefold() == "auto"
    tableau = None if automatic else find_tableau(options.solver)
    if system.states.size == 0 and system.sizes.hybrid:
        # A step without states goes from instant to instant and evaluates the guards.
        return EULER, "none needed: the system has no continuous states, only ticks and events"
    if system.states.size == 0:
        return None, "none needed: the system has no states, each sample is evaluated directly"
    if tableau is None and options.step is not None:
        return RK4, "a step was given, so a fixed-step method of order 4"
    if tableau is None:
        return DEFAULT, f"auto: {DEFAULT.title}, explicit, because no stiffness was detected"
    if tableau.adaptive and options.step is not None:
        raise InputError(
            f"solver {tableau.name} chooses its own steps, and step is {options.step:g} s",
            where=system.name,
            allowed=f"step with a fixed-step solver: {', '.join(t.name for t in TABLEAUX if not t.adaptive)}",
            fix="use max_step to bound the steps, or solver='rk4' ('ros5' for a stiff system)",
        )
    return tableau, f"requested: {tableau.title}"


def _sample_time(
    system: CompiledSystem, options: SimulationOptions, stop: float, fixed_step: float | None, *, logged: bool
) -> float:
    """The given sample time; else a multiple of the fixed step with at most 10 000 rows; else stop / 1000."""
    if options.sample_time is not None:
        sample_time = float(options.sample_time)
    elif fixed_step is not None and stop > 0.0:
        sample_time = fixed_step * max(1, math.ceil(stop / fixed_step / 10_000 * (1.0 - 1e-9)))
    else:
        sample_time = stop / DEFAULT_INTERVALS if stop > 0.0 else 1.0
    width = 1 + system.states.size + system.signals_layout.size
    if not logged and stop / sample_time * width > MAX_NUMBERS:
        samples = f"{stop / sample_time:.3g} samples of {width} numbers"
        raise InputError(
            f"a sample time of {sample_time:g} s over {stop:g} s records {samples}",
            where=system.name,
            allowed=f"at most {MAX_NUMBERS // width} samples, which take 4 GB",
            fix="choose a larger sample_time, which has no effect on the accuracy of the steps, "
            "or log the run to a file",
        )
    return sample_time


def parameter_vector(system: CompiledSystem, values: Mapping[str, ArrayLike] | ArrayLike | None) -> Array:
    """The flat parameters ``(np,)``: the system's values, replaced by given ``values``.

    ``values`` is a mapping from ``block.parameter`` to a value of its shape (a scalar sets all entries), or
    the whole flat vector. Raises ``UnknownNameError`` and ``InputError``.
    """
    if values is None:
        return system.parameter_values
    layout = system.parameters
    if isinstance(values, Mapping):
        return changed_parameters(system, system.parameter_values, values)
    p = np.array(values, dtype=np.float64)
    if p.shape != (layout.size,):
        raise InputError(
            f"the parameter vector has shape {p.shape}",
            where=system.name,
            allowed=f"({layout.size},): one number for each of {', '.join(layout.names) or 'none'}",
            fix="give a mapping by name instead",
        )
    # Infinite values are allowed if the diagram itself has them, such as infinite limits.
    return _require_finite(system, p, ~np.isfinite(p) & np.isfinite(system.parameter_values))


def changed_parameters(system: CompiledSystem, p: Array, values: Mapping[str, ArrayLike]) -> Array:
    """A copy of the flat parameters ``(np,)`` with new values for some, by ``block.parameter``.

    Infinite values are accepted, because limits may be infinite; each block checks its own parameters.

    Raises ``UnknownNameError`` and ``InputError``.
    """
    layout, p = system.parameters, p.copy()
    for name, value in values.items():
        if name not in layout.ranges:
            raise UnknownNameError("parameter", name, layout.names, where=system.name)
        slot = layout[name]
        array = np.asarray(value, dtype=np.float64)
        if array.shape not in ((), slot.shape):
            raise InputError(
                f"parameter '{name}' got a value of shape {array.shape}",
                where=system.name,
                allowed=f"shape {slot.shape}, or one number for all of it",
                fix="give one number for each element",
            )
        p[layout.ranges[name]] = np.broadcast_to(array, slot.shape).ravel()
    return _require_finite(system, p, np.isnan(p))


def _require_finite(system: CompiledSystem, p: Array, invalid: NDArray[np.bool_]) -> Array:
    """Return ``p``. Raises ``InputError`` that names the first parameter with an invalid number."""
    if invalid.any():
        layout = system.parameters
        name = next(slot.name for slot in layout if invalid[layout.ranges[slot.name]].any())
        raise InputError(
            f"parameter '{name}' is {p[layout.ranges[name]].tolist()}",
            where=system.name,
            allowed="finite numbers",
            fix="give finite numbers: NaN and infinity cannot be simulated",
        )
    return p
