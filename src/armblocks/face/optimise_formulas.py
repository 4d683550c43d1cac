"""Objectives and constraints of an optimisation: formulas of measures and of variables."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from casadi import SX, Function, densify, jacobian, vertcat
from numpy.typing import NDArray

from armblocks.diagram.mask import formula_number
from armblocks.errors import ArmblocksError, InputError, UnknownNameError
from armblocks.matlab.formula import Formula
from armblocks.simulation import SimulationResult
from armblocks.sweeps.measures import KINDS, Measure

Array = NDArray[np.float64]
PythonFunction = Callable[[SimulationResult], float]
Target = str | Measure | PythonFunction
"""An objective: a formula of measures, a measure, or a Python function of the result."""

_WORD = re.compile(r"[A-Za-z_]\w*")
_COMPARISON = re.compile(r"<=|>=|==|[<>]")
_OPEN, _CLOSED = "([{", ")]}"
_ALLOWED = "expression <= number, expression >= number, low <= expression <= high, expression == number"


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A constraint ``low <= value <= high`` with the text by which results name it."""

    name: str
    target: Target
    low: float
    high: float


def conditions(given: object, where: str) -> list[Condition]:
    """The constraints of an argument: strings, or triples of a function or measure, a low and a high limit.

    Raises ``InputError``.
    """
    if given is None:
        return []
    if not isinstance(given, Sequence):
        raise _unsuitable(given, where)
    whole = isinstance(given, str | tuple)
    entries = [cast("object", given)] if whole else list(cast("Sequence[object]", given))
    found: list[Condition] = []
    for entry in entries:
        if isinstance(entry, str):
            found.append(_from_text(entry, where))
            continue
        triple: tuple[object, ...] = cast("Any", entry) if isinstance(entry, tuple) else ()
        if len(triple) != 3 or not (isinstance(triple[0], Measure | str) or callable(triple[0])):
            raise _unsuitable(cast("object", entry), where)
        target = cast("Target", triple[0])
        low, high = (_limit(value, triple, where) for value in triple[1:])
        text = target if isinstance(target, str) else _title(target)
        found.append(Condition(name=_named(text, low, high), target=target, low=low, high=high))
    for condition in found:
        if not condition.low <= condition.high or math.inf in (condition.low, -condition.high):
            raise InputError(
                f"the limits of '{condition.name}' are {condition.low:g} and {condition.high:g}",
                where=where,
                allowed="a lower limit up to the upper one; -inf and inf for none",
                fix="exchange the limits",
            )
    return found


def _unsuitable(entry: object, where: str) -> InputError:
    return InputError(
        f"the constraint {entry!r:.60} is not suitable",
        where=where,
        allowed=f"a string {_ALLOWED}; or (function or measure, low, high)",
        fix="write for example 'overshoot(plant/y, final=1) <= 5'",
    )


def _limit(value: object, entry: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
        raise _unsuitable(entry, where)
    return float(value)


def _title(target: Measure | PythonFunction) -> str:
    return str(target) if isinstance(target, Measure) else str(getattr(target, "__name__", "function"))


def _named(text: str, low: float, high: float) -> str:
    if low == high:
        return f"{text} == {low:g}"
    left = f"{low:g} <= " if math.isfinite(low) else ""
    right = f" <= {high:g}" if math.isfinite(high) else ""
    return f"{left}{text}{right}"


def _from_text(text: str, where: str) -> Condition:
    """The condition of a text with one or two comparisons outside of brackets."""
    name = " ".join(text.split())
    place = f"{where}, constraint '{name}'"
    parts, signs = _divided(text)
    if not signs or len(signs) > 2 or any(sign in "<>" for sign in signs) or not all(parts):
        raise InputError(
            f"the text has {'no' if not signs else 'other'} comparisons",
            where=place,
            allowed=_ALLOWED,
            fix="write for example overshoot(plant/y, final=1) <= 5",
        )
    numbers = [_number(part, place) for part in parts]
    if len(signs) == 2:
        if numbers[0] is None or numbers[2] is None or signs not in (["<=", "<="], [">=", ">="]):
            raise InputError(
                "the two comparisons do not enclose an expression between numbers",
                where=place,
                allowed="low <= expression <= high",
                fix="write two constraints",
            )
        low, high = (numbers[0], numbers[2]) if signs[0] == "<=" else (numbers[2], numbers[0])
        return Condition(name=name, target=parts[1], low=low, high=high)
    left, right = parts
    if numbers[0] is not None:  # the number belongs to the right
        flipped = {"<=": ">=", ">=": "<=", "==": "=="}
        left, right, signs, numbers = right, left, [flipped[signs[0]]], [numbers[1], numbers[0]]
    if numbers[0] is not None:
        raise InputError(
            "both sides are numbers",
            where=place,
            allowed="an expression with a measure, or with a variable in braces",
            fix="name a measure",
        )
    limit = numbers[1]
    if limit is None:
        left, limit = f"({left}) - ({right})", 0.0
    low = -math.inf if signs[0] == "<=" else limit
    high = math.inf if signs[0] == ">=" else limit
    return Condition(name=name, target=left, low=low, high=high)


def _divided(text: str) -> tuple[list[str], list[str]]:
    """The parts of a text between comparisons outside of brackets, and the comparisons."""
    parts, signs, depth, place = [""], list[str](), 0, 0
    while place < len(text):
        character = text[place]
        depth += (character in _OPEN) - (character in _CLOSED)
        sign = _COMPARISON.match(text, place) if depth == 0 else None
        if sign is not None:
            signs.append(sign[0])
            parts.append("")
            place = sign.end()
            continue
        parts[-1] += character
        place += 1
    return [part.strip() for part in parts], signs


def _number(text: str, where: str) -> float | None:
    """The value of a string without measures and variables; ``None`` for other strings."""
    if "{" in text or any(word in KINDS for word in _WORD.findall(text)):
        return None
    try:
        value = formula_number(text, where)
    except ArmblocksError:
        return None
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


class Formulas:
    """The objective and the constraints as functions of the measures ``m (nm,)`` and variables ``x (n,)``."""

    def __init__(self, targets: Sequence[Target], variables: Sequence[str], where: str) -> None:
        """Raises ``InputError`` and ``UnknownNameError`` for strings that are not formulas of these names."""
        self._variables, self._where = list(variables), where
        self._measures: dict[str, Measure] = {}
        self._functions: dict[str, PythonFunction] = {}
        x = SX.sym("x", len(variables))
        values = [self._traced(target, x) for target in targets]
        # The symbols of the measures are known when all strings are read.
        names = [*self._measures, *self._functions]
        m = SX.sym("m", len(names))
        column = vertcat(
            *(value(dict(zip(names, (m[k] for k in range(len(names)))))) for value in values), SX(0, 1)
        )
        parts = [column, jacobian(column, m), jacobian(column, x)]
        self._function = Function("formulas", [m, x], [densify(part) for part in parts])

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The measures, the first columns of ``m``."""
        return tuple(self._measures.values())

    @property
    def functions(self) -> tuple[PythonFunction, ...]:
        """The Python functions, the last columns of ``m``."""
        return tuple(self._functions.values())

    def values(self, m: Array, x: Array) -> Array:
        """The values of all formulas ``(N, k)`` for measures ``(N, nm)`` and variables ``(N, n)``."""
        rows = [self.at(*row)[0] for row in zip(m, x)]
        return np.array(rows).reshape(len(m), -1)

    def at(self, m: Array, x: Array) -> tuple[Array, Array, Array]:
        """Values ``(k,)``, and derivatives with respect to measures ``(k, nm)`` and variables ``(k, n)``."""
        value, by_m, by_x = (np.asarray(part, dtype=np.float64) for part in self._function.call([m, x]))
        return value.ravel(), by_m, by_x

    def _traced(self, target: Target, x: SX) -> Callable[[Mapping[str, SX]], SX]:
        if isinstance(target, Measure):
            name = self._symbol(target)
            return lambda symbols: symbols[name]
        if not isinstance(target, str):
            name = f"function_{len(self._functions)}_"
            self._functions[name] = target
            return lambda symbols: symbols[name]
        text, used = self._replaced(target)
        where = f"{self._where}, formula '{target}'"
        formula = Formula(text, where)
        unknown = sorted(formula.names - used.keys())
        if unknown:
            known = [f"{kind}(signal)" for kind in KINDS] + [f"{{{name}}}" for name in self._variables]
            raise UnknownNameError("measure or variable", unknown[0], known, where=where)

        def value(symbols: Mapping[str, SX]) -> SX:
            traced = formula.trace({name: symbols[name] if k is None else x[k] for name, k in used.items()})
            if traced.shape != (1, 1):
                raise InputError(
                    f"the formula has {traced.numel()} entries",
                    where=where,
                    allowed="a formula with one number",
                    fix="use a sum or a norm",
                )
            return traced

        return value

    def _symbol(self, measure: Measure) -> str:
        for name, known in self._measures.items():
            if known == measure:
                return name
        name = f"measure_{len(self._measures)}_"
        self._measures[name] = measure
        return name

    def _replaced(self, text: str) -> tuple[str, dict[str, int | None]]:
        """The text with symbols for measures and variables; the symbols with the numbers of variables."""
        result, place = "", 0
        used: dict[str, int | None] = {}
        while place < len(text):
            if text[place] == "{":
                end = text.find("}", place)
                name = text[place + 1 : end].strip() if end > 0 else text[place + 1 :]
                if end < 0 or name not in self._variables:
                    where = f"{self._where}, formula '{text}'"
                    raise UnknownNameError("variable", name, self._variables, where=where)
                number = self._variables.index(name)
                used[f"variable_{number}_"] = number
                result, place = f"{result}variable_{number}_", end + 1
                continue
            word = _WORD.match(text, place)
            if word is None:
                result, place = result + text[place], place + 1
                continue
            end = _call_end(text, word.end()) if word[0] in KINDS else 0
            if end:
                symbol = self._symbol(Measure.parse(text[place:end]))
                used[symbol] = None
                result, place = result + symbol, end
            else:
                result, place = result + word[0], word.end()
        return result, used


def _call_end(text: str, place: int) -> int:
    """The end of the brackets that begin at ``place``, after blanks; 0 if there are none."""
    begin = len(text) - len(text[place:].lstrip())
    if not text.startswith("(", begin):
        return 0
    depth = 0
    for end in range(begin, len(text)):
        depth += (text[end] in _OPEN) - (text[end] in _CLOSED)
        if depth == 0:
            return end + 1
    return 0
