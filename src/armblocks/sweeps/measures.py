"""Measures of a sweep as the arguments describe them, and their quantities in a compiled system."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from casadi import SX, Function, vertcat

from armblocks.argument_errors import ArgumentErrors
from armblocks.equations import Signature, Slot, TracedFunction
from armblocks.errors import InputError, UnknownArgumentError, UnknownNameError, shortened_list
from armblocks.matlab.formula import Formula
from armblocks.simulation.signal_names import signal_path
from armblocks.sweeps.measure_routines import ROUTINES
from armblocks.sweeps.quantities import EVENTS, Expressions, Observation, RunMeasure, RunQuantity

OPTION_NAMES: Mapping[str, tuple[str, ...]] = {
    "iae": ("reference",),
    "ise": ("reference",),
    "itae": ("reference",),
    "overshoot": ("final",),
    "undershoot": ("final",),
    "rise_time": ("final",),
    "settling_time": ("final", "band"),
    "crossing_time": ("level", "direction"),
    "time_outside": ("low", "high"),
}
"""The options of each kind, in the order of the native functions."""
DEFAULTS: Mapping[str, float] = {
    "reference": 0.0,
    "final": math.nan,
    "band": 0.02,
    "direction": 0.0,
    "low": -math.inf,
    "high": math.inf,
}
"""Default values of options; a NaN for ``final`` selects the last value of each run."""
KINDS = (*ROUTINES, EVENTS)

_BRACES = re.compile(r"\{([^{}]*)\}")
_CALL = re.compile(r"\s*(\w+)\s*\((.*)\)\s*", re.DOTALL)
_OPTION = re.compile(r"\s*(\w+)\s*=([^=].*)", re.DOTALL)


@dataclass(frozen=True)
class Measure(metaclass=ArgumentErrors):
    """A number that describes one signal of a run, for :func:`armblocks.sweep`.

    ``Measure("overshoot", "motor/speed", {"final": 1.0})``. The ``signal`` is the path of a scalar or of an
    entry, ``"arm/tau[0]"``, or an expression with paths in braces: ``"{arm/tau[0]} * {arm/qd[0]}"``. As text:
    ``"overshoot(motor/speed, final=1)"``.

    Between samples the signal is interpolated linearly, and integrals are exact for the interpolated signal.
    A recorded jump contributes its values on both sides. Kinds and their options:

    - ``minimum``, ``maximum``, ``peak`` (largest absolute value), ``final`` (last value), ``mean`` and
      ``rms`` (averages over the time of the run), ``integral``.
    - ``iae``, ``ise``, ``itae``: integrals of ``|e|``, ``e^2`` and ``t |e|`` of the error ``e = reference -
      signal``; ``reference`` is a number, by default 0.
    - ``overshoot``, ``undershoot`` (per cent of ``final``), ``rise_time`` (10 to 90 per cent, s),
      ``settling_time`` (s, after which the signal stays within ``band``, by default 0.02 of ``final``): as
      for a step response. Without ``final``, the last value of each run is the final value. NaN where the
      final value is 0.
    - ``crossing_time`` (s): the first crossing of ``level``; ``direction`` 1: from below, -1: from above.
    - ``time_outside`` (s): the total time below ``low`` or above ``high``.
    - ``events``: the number of events of the run, without a signal.

    Raises ``InputError``, ``UnknownNameError`` and ``UnknownArgumentError``.
    """

    kind: str
    signal: str = ""
    options: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        where = f"measure '{self.kind}'"
        if self.kind not in KINDS:
            raise UnknownNameError("measure", self.kind, KINDS, where="sweep")
        known = OPTION_NAMES.get(self.kind, ())
        for name, value in self.options.items():
            if name not in known:
                raise UnknownArgumentError(name, known, where=where)
            if not _is_number(value):
                raise InputError(
                    f"{name} is {value!r}", allowed="a number", where=where, fix=f"give another {name}"
                )
        if (self.kind == EVENTS) == bool(self.signal.strip()):
            raise InputError(
                f"the signal is {self.signal!r}",
                allowed="no signal" if self.kind == EVENTS else "the path of a signal, or an expression",
                where=where,
                fix="write events()" if self.kind == EVENTS else f"write for example {self.kind}(plant/y)",
            )
        if self.kind == "crossing_time" and "level" not in self.options:
            raise InputError(
                "the level is missing",
                allowed="crossing_time(signal, level=…)",
                where=where,
                fix="give the level",
            )
        low, high = self.options.get("low", -math.inf), self.options.get("high", math.inf)
        if low > high:
            raise InputError(
                f"low is {_exact(low)} and high is {_exact(high)}",
                allowed="low up to high",
                where=where,
                fix="exchange them",
            )

    @property
    def values(self) -> tuple[float, ...]:
        """The values of all options, in the order of the native function."""
        options = {**DEFAULTS, **self.options}
        return tuple(float(options[name]) for name in OPTION_NAMES.get(self.kind, ()))

    @staticmethod
    def parse(text: str) -> Measure:
        """The measure of a text, ``"settling_time(plant/y, final=1, band=0.05)"``.

        Raises ``InputError`` for another form, and the errors of the constructor.
        """
        call = _CALL.fullmatch(text)
        if call is None:
            raise InputError(
                f"'{text}' is not a measure",
                allowed="kind(signal) or kind(signal, option=number)",
                where="sweep",
                fix="write for example overshoot(plant/y, final=1)",
            )
        signal, *rest = _arguments(call[2])
        options: dict[str, float] = {}
        for part in rest:
            option = _OPTION.fullmatch(part)
            try:
                number = float(option[2]) if option else math.nan
            except ValueError:
                number = math.nan
            if option is None or math.isnan(number):
                raise InputError(
                    f"'{part.strip()}' is not an option",
                    allowed="option=number",
                    where=f"measure '{text}'",
                    fix="write for example final=1",
                )
            options[option[1]] = number
        return Measure(call[1], signal.strip(), options)

    def __str__(self) -> str:
        options = [f"{name}={_exact(value)}" for name, value in self.options.items()]
        return f"{self.kind}({', '.join(filter(None, [self.signal, *options]))})"


def _exact(value: float) -> str:
    """The shortest text of a number from which ``float`` reads the same number."""
    return repr(float(value)).removesuffix(".0")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)


def _arguments(text: str) -> list[str]:
    """The parts of a text between commas outside of brackets."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def signal_row(name: str, layout: Signature, aliases: Mapping[str, str], where: str) -> int:
    """The row of a scalar signal, or of an entry of a signal, by its path.

    Raises ``UnknownNameError``, and ``InputError`` for a signal with several entries.
    """
    head, bracket, entry = name.rpartition("[")
    if bracket and name not in layout.ranges:
        slot = layout[signal_path(head, layout, aliases, where)]
        numbered = Slot(slot.name, slot.shape)
        for names in (slot.entry_names, numbered.entry_names):
            wanted = entry.removesuffix("]").replace(" ", "")
            if wanted in names:
                return layout.ranges[slot.name].start + names.index(wanted)
        raise UnknownNameError("signal", name, slot.elements, where=where)
    slot = layout[signal_path(name, layout, aliases, where)]
    if slot.size != 1:
        raise InputError(
            f"the signal '{name}' has {slot.size} entries",
            allowed=shortened_list(slot.elements),
            where=where,
            fix="name one entry",
        )
    return layout.ranges[slot.name].start


def signal_entries(name: str, layout: Signature, aliases: Mapping[str, str]) -> tuple[str, ...]:
    """The paths of all entries of a signal; an expression or a single entry has one path.

    Raises ``UnknownNameError``.
    """
    if "{" in name or (name.endswith("]") and name not in layout.ranges):
        return (name,)
    path = signal_path(name, layout, aliases, "sweep")
    return layout[path].elements if layout[path].size != 1 else (name,)


def observe(
    measures: Sequence[Measure], kept: Sequence[str], layout: Signature, aliases: Mapping[str, str]
) -> Observation:
    """The observation of measures and kept signals in a system with this layout of signals.

    Raises ``UnknownNameError`` and ``InputError``.
    """
    texts = dict.fromkeys([*(m.signal for m in measures if m.kind != EVENTS), *kept])
    quantities: list[RunQuantity] = []
    formulas: list[tuple[SX, Mapping[str, SX], Mapping[str, int]]] = []
    for text in texts:
        if "{" not in text:
            row = signal_row(text, layout, aliases, "sweep")
            quantities.append(RunQuantity(row=row, used=(row,)))
            continue
        rows: dict[str, int] = {}

        def symbol(match: re.Match[str], rows: dict[str, int] = rows) -> str:
            name = f"signal_{len(rows)}_"
            rows[name] = signal_row(match[1].strip(), layout, aliases, "sweep")
            return name

        formula = Formula(_BRACES.sub(symbol, text), f"measure of '{text}'")
        symbols = {name: SX.sym(name) for name in (*rows, "t")}
        value = formula.trace(symbols)
        if value.shape != (1, 1):
            raise InputError(
                f"the expression '{text}' has {value.numel()} entries",
                allowed="an expression with one number",
                where="sweep",
                fix="select an entry, or use a norm",
            )
        formulas.append((value, symbols, rows))
        quantities.append(RunQuantity(row=-len(formulas), used=tuple(sorted(set(rows.values())))))
    places = {text: k for k, text in enumerate(texts)}
    return Observation(
        quantities=tuple(quantities),
        measures=tuple(
            RunMeasure(kind=m.kind, quantity=places.get(m.signal, 0), options=m.values) for m in measures
        ),
        kept=tuple(places[name] for name in kept),
        expressions=_expressions(formulas, layout.size),
    )


def _expressions(
    formulas: Sequence[tuple[SX, Mapping[str, SX], Mapping[str, int]]], signals: int
) -> Expressions | None:
    """The formulas as one function of the time and all signals; ``None`` if there are none."""
    if not formulas:
        return None

    def equations(t: SX, y: SX) -> SX:
        results: list[SX] = []
        for value, symbols, rows in formulas:
            names = list(symbols)
            values = [t if name == "t" else y[rows[name]] for name in names]
            results.append(
                Function("f", [symbols[name] for name in names], [value]).call(values, True, False)[0]
            )
        return vertcat(*results)

    inputs = Signature((Slot("t"), Slot("y", (signals,))))
    outputs = Signature((Slot("values", (len(formulas),)),))
    return Expressions(TracedFunction.trace("expressions", inputs, outputs, equations))
